"""A range coder with adaptive models: whole numbers in about as many bits as they are unforeseen.

It computes in whole numbers alone, so that JavaScript (templates/compact.js.jinja) reads what Python writes.
The coder is the one of LZMA (Igor Pavlov), the models count (Krichevsky and Trofimov 1981).
"""

from __future__ import annotations

from collections import defaultdict

LEAST = 1 << 24  # of a range: below it a byte is done
EVEN = 1 << 15  # a probability of one half
SURE = 32  # the least probability
KEPT, USED = 16, 12  # bits of a probability
SLOWNESS = 1.5  # bits that a model counts as seen before the first
SETTLED = 40  # bits seen, after which a model forgets the first ones
RATES = tuple(int((1 << KEPT) / (seen + SLOWNESS)) for seen in range(SETTLED + 1))
FORESEEN = 3  # leading bits of a number that have models
CLASS = 5  # bits that say how many bits a difference has
LONGEST = 40  # bits of a count
AHEAD = 4  # bytes that a reader takes before they matter

Name = tuple[object, ...]  # of the models of numbers that are alike


class EndedError(ValueError):
    """There is less to read than is asked for."""


class Bit:
    """What is known about a bit: how probable a 0 is, and how often it was seen."""

    __slots__ = ("probability", "seen")

    def __init__(self) -> None:
        self.probability, self.seen = EVEN, 0

    def learn(self, bit: int) -> None:
        aim = SURE if bit else (1 << KEPT) - SURE
        self.probability += ((aim - self.probability) * RATES[self.seen]) >> KEPT
        self.seen = min(self.seen + 1, SETTLED)


class Coder:
    """Numbers of several sorts. A writer writes what it is given and a reader reads; both return the number."""

    def __init__(self) -> None:
        self.models: defaultdict[Name, Bit] = defaultdict(Bit)
        self.range = (1 << 32) - 1

    def code(self, bit: int, model: Bit | None = None) -> int:
        """One bit, as likely 0 as 1 where there is no model."""
        probability = model.probability if model else EVEN
        bit = self._place(bit, (self.range >> USED) * (probability >> (KEPT - USED)))
        if model:
            model.learn(bit)
        return bit

    def _place(self, bit: int, bound: int) -> int:
        """A bit whose share of the range is below a bound where it is 0, else above it."""
        raise NotImplementedError

    def raw(self, value: int = 0, bits: int = 1) -> int:
        """A number of so many bits of which nothing is known."""
        return sum(self.code(value >> place & 1) << place for place in reversed(range(bits)))

    def count(self, value: int = 0) -> int:
        """A number from 0 on, in the fewer bits the smaller it is (Elias gamma)."""
        wanted, bits = (value + 1).bit_length() - 1, 0
        while self.code(int(bits < wanted)):
            bits += 1
            if bits > LONGEST:
                raise EndedError
        return (1 << bits) - 1 + self.raw(value + 1 - (1 << wanted), bits)

    def signed(self, value: int = 0) -> int:
        """A number of either sign."""
        coded = self.count(2 * value if value >= 0 else -2 * value - 1)
        return coded // 2 if coded % 2 == 0 else -(coded + 1) // 2

    def leading(self, name: Name, value: int = 0, bits: int = 1) -> int:
        """A number of so many bits, whose first ones have models."""
        found = 1
        for place in reversed(range(bits)):
            model = self.models[*name, found] if found < 1 << FORESEEN else None
            found = found << 1 | self.code(value >> place & 1, model)
        return found - (1 << bits)

    def difference(self, name: Name, value: int = 0) -> int:
        """A number near 0, of either sign: its number of bits, its sign and its second bit have models."""
        size, tree = abs(value).bit_length(), 1
        for place in reversed(range(CLASS)):
            tree = tree << 1 | self.code(size >> place & 1, self.models[*name, tree])
        if (bits := tree - (1 << CLASS)) == 0:
            return 0
        found, rest = 1, abs(value)
        for place in reversed(range(bits - 1)):
            model = self.models[*name, "second", bits] if place == bits - 2 else None
            found = found << 1 | self.code(rest >> place & 1, model)
        return -found if self.code(int(value < 0), self.models[*name, "sign"]) else found


class Writer(Coder):
    """Writes numbers into bytes."""

    def __init__(self) -> None:
        super().__init__()
        self._low, self._written = 0, bytearray()

    def _place(self, bit: int, bound: int) -> int:
        if bit:
            self._low += bound
        self.range = self.range - bound if bit else bound
        while self.range < LEAST:
            self.range <<= 8
            self._shift()
        return bit

    def _shift(self) -> None:
        """Writes the highest byte of the low end; what it carries goes into those before."""
        place = len(self._written)
        while self._low >> 32 and place:
            place -= 1
            self._written[place] = (self._written[place] + 1) & 255
            if self._written[place]:
                break
        self._low &= (1 << 32) - 1
        self._written.append(self._low >> 24)
        self._low = (self._low << 8) & ((1 << 32) - 1)

    def done(self) -> bytes:
        """All that was written: a reader takes what follows for 0."""
        end = self._low + self.range - 1
        kept = next(bits for bits in range(32, -1, -8) if (end >> bits << bits) >= self._low)
        self._low = end >> kept << kept
        for _ in range(AHEAD):
            self._shift()
        return bytes(self._written[: len(self._written) - kept // 8])


class Reader(Coder):
    """Reads what a `Writer` has written, from a place on. Raises EndedError where there is no more."""

    def __init__(self, data: bytes, place: int = 0) -> None:
        super().__init__()
        self._data, self._taken, self._code = data, place, 0
        for _ in range(AHEAD):
            self._take()

    def _take(self) -> None:
        if self._taken >= len(self._data) + AHEAD:
            raise EndedError
        byte = self._data[self._taken] if self._taken < len(self._data) else 0
        self._code = self._code << 8 | byte
        self._taken += 1

    def _place(self, bit: int, bound: int) -> int:
        bit = int(self._code >= bound)
        self._code -= bound if bit else 0
        self.range = self.range - bound if bit else bound
        while self.range < LEAST:
            self.range <<= 8
            self._take()
        return bit

    @property
    def left(self) -> int:
        """Bytes that nothing was read of."""
        return max(0, len(self._data) - self._taken)
