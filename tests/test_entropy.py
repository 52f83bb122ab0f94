"""The range coder: whatever is written is read again, in about as many bits as the numbers are unforeseen."""

import math
import random

import pytest

from sdf2vec.entropy import AHEAD, EndedError, Reader, Writer

SORTS = {
    "raw": lambda r: (r.getrandbits(9), 9),
    "count": lambda r: (int(r.expovariate(0.01)),),
    "signed": lambda r: (int(r.gauss(0, 300)),),
    "leading": lambda r: (("leading",), r.getrandbits(6) >> r.randrange(6), 6),
    "difference": lambda r: (("difference",), int(r.gauss(0, r.choice([0.3, 3.0, 1e6])))),
}
VALUE = {"leading": 1, "difference": 1}  # which argument the number is


def written(numbers):
    coder = Writer()
    for sort, given in numbers:
        assert getattr(coder, sort)(*given) == given[VALUE.get(sort, 0)]
    return coder.done()


@pytest.mark.parametrize("seed", range(60))
def test_what_is_written_is_read(seed):
    r = random.Random(seed)
    sorts = r.choices(list(SORTS), k=r.randrange(120))
    numbers = [(sort, SORTS[sort](r)) for sort in sorts]
    data = written(numbers)
    coder = Reader(b"before" + data, 6)
    for sort, given in numbers:
        blank = [0 if i == VALUE.get(sort, 0) else value for i, value in enumerate(given)]
        assert getattr(coder, sort)(*blank) == given[VALUE.get(sort, 0)]
    assert coder.left == 0


def test_numbers_take_about_their_entropy():
    """Two thousand differences, nine of ten 0 and the rest ±1: 0.469 + 0.1 bits each."""
    r = random.Random(1)
    values = [r.choice((-1, 1)) if r.random() < 0.1 else 0 for _ in range(2000)]
    share = sum(map(abs, values)) / len(values)
    entropy = -share * math.log2(share) - (1 - share) * math.log2(1 - share) + share
    data = written([("difference", (("d",), value)) for value in values])
    assert len(data) * 8 <= 1.08 * entropy * len(values)


def test_reading_on_beyond_the_end_is_refused():
    coder = Reader(written([("raw", (5, 8))]))
    with pytest.raises(EndedError):
        coder.raw(0, 8 * (AHEAD + 8))
