"""Kernels against the same functions in plain Python, which they are written in."""

from math import ceil, floor

import numpy as np
import pytest

from sdf2vec.kernel_cache import Assembly, Kernel, kernel
from sdf2vec.lower.llvm import assembled
from sdf2vec.lower.loops import F32, F64, I32, I64, ONE, ZERO, call, empty, f32, inlined

SIDE = 5


@inlined
def first_above(numbers, least):
    for i in range(numbers.size):
        if numbers[i] > least:
            return i, numbers[i]
    return numbers.size, ZERO


@kernel
def rows(table: F32[2], least: F32, found: F64[1], places: I32[1]) -> I64:
    """Rows, tails, functions that return early, numbers of several types."""
    count = 0
    for y in range(table.shape[0]):
        row = table[y]
        place, value = first_above(row[1:], least)
        places[y] = place
        if place == len(row) - 1:
            continue
        found[y] += value / 3 if value > ONE else value
        count += 1
    return count


@kernel
def fills(table: F32[3], out: F32[3]):
    """Numbers and parts of arrays, put everywhere in parts of arrays."""
    for c in range(len(table)):
        out[c, 0] = f32(c) * f32(0.5)
        out[c, 1, 1:3] = table[c, 0, 2:4]
        out[c, 2, :2] = -table[c, 1, 1] if c % 2 == 0 else ONE
        out[c, 2, 2:] = min(table[c, 1, 0], max(table[c, 2, 2], ZERO), ONE)


@kernel
def rounded(values: F32[1], side: I64, out: I64[1]) -> F64:
    """Counting backwards and by steps; whole numbers beside floats."""
    total = 0.0
    for i in range(0, values.size, 2):
        last = values.size - 1 - i
        out[last] = max(floor(values[last] * side), -ceil(values[last]), 0 - 3)
        total += values[last] + i // 2
    return total


@kernel
def total(numbers: I32[1], places: I64[1]) -> I64:
    """Small integers, which may be negative."""
    found = 0
    for i in range(numbers.size):
        places[i] = numbers[i]
        found += numbers[i]
    return found


@kernel
def sums(table: F32[2], out: F32[1]):
    """Room of its own."""
    line = empty(SIDE)
    line[:] = ZERO
    for y in range(table.shape[0]):
        for x in range(SIDE):
            line[x] += table[y, x]
    out[:] = line


R = np.random.default_rng(0)
TABLE = R.standard_normal((4, SIDE)).astype(np.float32)
CUBE = R.standard_normal((3, 3, 4)).astype(np.float32)
GIVEN = {
    "rows": (rows, (TABLE, np.float32(0.9), np.zeros(4), np.zeros(4, np.int32))),
    "fills": (fills, (CUBE, np.zeros_like(CUBE))),
    "total": (total, (np.array([3, -5, -70], np.int32), np.zeros(3, np.int64))),
    "rounded": (rounded, (TABLE.ravel(), 7, np.zeros(TABLE.size, np.int64))),
}


@pytest.mark.parametrize("name", GIVEN)
def test_a_kernel_does_what_python_does(name):
    function, given = GIVEN[name]
    kinds = function.arguments.values()
    mine, plain = (
        [np.copy(v) if k.dimensions else v for k, v in zip(kinds, given, strict=True)] for _ in "ab"
    )
    assert function(*mine) == pytest.approx(function.py_func(*plain))
    for a, b in zip(mine, plain, strict=True):
        assert a == pytest.approx(b, rel=1e-6)


def test_rows_are_found_as_by_eye():
    """So that both are not wrong alike."""
    found, places = np.zeros(4), np.zeros(4, np.int32)
    wanted = [next((i for i, v in enumerate(row[1:]) if v > 0.9), 4) for row in TABLE.tolist()]
    assert rows(TABLE, 0.9, found, places) == sum(place < 4 for place in wanted)
    assert places.tolist() == wanted


def test_room_of_its_own():
    out = np.empty(SIDE, np.float32)
    sums(TABLE, out)
    assert out == pytest.approx(TABLE.sum(axis=0), rel=1e-5)


DOUBLE = """
define void @double(ptr %numbers, i64 %place) {
  %p = getelementptr float, ptr %numbers, i64 %place
  %a = load float, ptr %p
  %b = fadd float %a, %a
  store float %b, ptr %p
  ret void
}
"""


@kernel
def doubled(address: I64, numbers: F32[1], place: I64):
    call(address, (numbers[1:], place))


def test_a_function_is_called_by_its_address():
    numbers = np.arange(4, dtype=np.float32)
    doubled(Assembly(assembled([DOUBLE]))["double"].address, numbers, 1)
    assert numbers.tolist() == [0, 1, 4, 3]


@pytest.mark.parametrize(
    "wrong",
    [TABLE.ravel(), TABLE.T, TABLE.astype(np.float64), TABLE[:, ::2]],
    ids=["flat", "turned", "wide", "apart"],
)
def test_arrays_of_another_kind_are_refused(wrong):
    with pytest.raises(TypeError, match="table"):
        sums(wrong, np.empty(SIDE, np.float32))


def assigns_to_an_argument(x: I64):
    x = 2  # noqa: F841


def calls_anything(x: I64):
    print(x)


def takes_a_column(x: F32[2]):
    x[:, 0] = ONE


@pytest.mark.parametrize("function", [assigns_to_an_argument, calls_anything, takes_a_column])
def test_what_is_not_understood_fails_when_it_is_read(function):
    with pytest.raises((AssertionError, KeyError, AttributeError, TypeError)):
        assert Kernel(function).assembly.text
