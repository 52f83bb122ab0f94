"""Records and lists as the numbers of a shader's text, and of a texture beside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Float32Array, IntArray
from ..lower.shader import literal
from ..scene import Scene
from .records import form_of, records

DATA_WIDTH = 256  # texels in a row of a data texture


def words_of(numbers: Sequence[int], bits: int, per: int) -> list[int]:
    """`per` numbers of so many bits in each word, the first in its lowest bits."""
    groups = (numbers[i : i + per] for i in range(0, len(numbers), per))
    return [sum(number << (bits * place) for place, number in enumerate(group)) for group in groups]


def data_array(rows: Float32Array, numbers: IntArray) -> Float32Array:
    """Records [R, 4] and whole numbers [M] after them as texels, [rows, DATA_WIDTH, 4]."""
    flat = np.concatenate([rows.ravel(), numbers.astype(np.float32)])
    padded = np.zeros(-(-len(flat) // (4 * DATA_WIDTH)) * 4 * DATA_WIDTH, np.float32)
    padded[: len(flat)] = flat
    return padded.reshape(-1, DATA_WIDTH, 4)


def table_rows(scene: Scene) -> list[list[str]]:
    """The text of each vec4 of a scene's records, [stride][shapes]."""
    table = records(scene, form_of(scene))
    return [[vec4_of(row) for row in rows.tolist()] for rows in table.swapaxes(0, 1)]


def vec4_of(values: list[float]) -> str:
    """Four numbers in GLSL."""
    return f"vec4({','.join(short(value) for value in values)})"


def short(value: float) -> str:
    """A number in a GLSL constructor: the shortest text that reads back as the same float32."""
    text = literal(value)
    return (
        text.removesuffix(".0").replace("0.", ".", 1)
        if text.lstrip("-").startswith("0.")
        else (text.removesuffix(".0"))
    )


def ivec4s(numbers: list[int]) -> list[str]:
    """Whole numbers in GLSL, four at a time, the last filled up by 0."""
    padded = numbers + [0] * (-len(numbers) % 4)
    return [f"ivec4({','.join(map(str, padded[i : i + 4]))})" for i in range(0, len(padded), 4)]
