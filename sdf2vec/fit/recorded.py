"""Steps on a GPU as CUDA graphs: recorded once, then launched as a whole. Else launching hundreds of small kernels, one
after the other, takes many times as long as they do.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache, partial
from typing import Any, NamedTuple

import torch

from ..render.triton_fused import Room
from ..render.triton_fused import composite as composite_triton
from .adam import Adam, cosine
from .steps import Composite, Plain, Value

# times the pairs of a tile and a layer that there are, and so many more, for which a step has memory: they change
ROOMY, SPARE = 1.5, 1024


class Said(NamedTuple):
    """What a step's derivatives say, all of which the CPU waits for at once."""

    value: float
    pairs: float
    lost: float
    both: float
    now: float
    before: float


class Recorded(Plain):
    """Steps as two graphs, of derivatives and of Adam; recorded anew where more tiles are touched than there is room
    for. Where something in them can't be recorded, which is said, they are as usual.

    The scene, the optimizer and their tensors are those of the beginning.
    """

    graphs: tuple[Any, Any] | None  # torch.cuda.CUDAGraph
    read: Said
    most: int  # pairs that there is room for

    def __init__(self, value: Value, composite: Composite, optimizer: Adam, keep: Callable[[], None]) -> None:
        super().__init__(value, composite, optimizer, keep)
        self.factor = optimizer.moving[0].tensor.new_ones(())
        self.said = torch.zeros(len(Said._fields), dtype=torch.float64, device=self.factor.device)
        self.room = Room()
        _aside(self._derive)  # once as usual: all kernels are compiled
        self._record()

    def slope(self) -> float:
        while self.graphs:
            self.graphs[0].replay()
            self.read = Said(*self.said.tolist())
            if self.read.pairs <= self.most:
                return self.read.value
            self._record()
        return super().slope()

    def drop_what_is_not_finite(self) -> int:
        return int(self.read.lost) if self.graphs else super().drop_what_is_not_finite()

    def agreement(self) -> float:
        read = self.read
        return cosine(read.both, read.now, read.before) if self.graphs else super().agreement()

    def move(self, factor: float | torch.Tensor) -> None:
        if not self.graphs:
            super().move(factor)
            return
        self.factor.fill_(factor)
        self.graphs[1].replay()

    def _record(self) -> None:
        """For about as many pairs as there are now."""
        self.read = Said(*self.said.tolist())
        self.most = round(ROOMY * self.read.pairs) + SPARE
        self.room = Room(self.most)
        try:
            adam = partial(super().move, self.factor)
            self.graphs = _graph_of(self._derive), _graph_of(adam)
        except RuntimeError as error:
            self.graphs = None
            _keeper.cache_clear()  # its memory still waits for the end of what was being recorded
            reason = str(error).strip().partition("\n")[0]
            message = f"the steps of a fit can't be recorded here, and take longer ({reason})"
            warnings.warn(message, RuntimeWarning, stacklevel=2)

    def _derive(self) -> None:
        """All derivatives, those that are no numbers 0, and what they say."""
        self.optimizer.zero_grad()
        value = self.value(partial(composite_triton, room=self.room))
        value.backward()
        pairs = self.room.needed
        lost = value.new_zeros(())
        for grad in self.optimizer.grads:
            lost += ~grad.sum().isfinite()
            grad.nan_to_num_(0.0, 0.0, 0.0)
        told = [value.detach(), value.new_zeros(()) if pairs is None else pairs, lost]
        self.said.copy_(torch.cat([torch.stack([each.double() for each in told]), self.optimizer.products()]))


# --- CUDA ---------------------------------------------------------------------------------------------------


def _graph_of(work: Callable[[], object], pool: Any = None) -> Any:
    graph = torch.cuda.CUDAGraph()

    def recorded() -> None:
        graph.capture_begin(pool=pool or _keeper().pool())
        try:
            work()
        finally:
            graph.capture_end()

    _aside(recorded)
    return graph


def _aside(work: Callable[[], None]) -> None:
    """Does it on a stream of its own, where alone it may be recorded."""
    stream, usual = _stream(), torch.cuda.current_stream()
    stream.wait_stream(usual)
    with torch.cuda.stream(stream):
        work()
    usual.wait_stream(stream)


@cache
def _stream() -> Any:
    return torch.cuda.Stream()


@cache
def _keeper() -> Any:
    """A graph whose memory is kept because it is."""
    return _graph_of(lambda: torch.zeros(1, device="cuda"), torch.cuda.graph_pool_handle())
