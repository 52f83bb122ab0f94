"""Which of several texts that mean the same compress best."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

UNSEEN = 0.5  # how often a character counts that no text has


def compressible(texts: Sequence[Sequence[str]], around: str = "") -> list[str]:
    """One of each of several texts: of characters that are frequent, which Huffman's code says in few bits.

    Frequent in the shortest ones, and in `around`, which is compressed with them.
    """
    counts = Counter(around)
    for choices in texts:
        shortest = min(choices, key=len)
        counts.update(shortest)
    total = math.log2(max(1, counts.total()))

    def bits(text: str) -> float:
        return sum(total - math.log2(counts[character] or UNSEEN) for character in text)

    return [min(choices, key=bits) for choices in texts]
