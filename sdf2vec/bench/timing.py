"""How fast the fused renderer is: ratios are measured side by side in one run, of a picture made by code."""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from ..blend import OVER
from ..expr import Expr
from ..fit.adam import adam_over
from ..fit.initialization import Layers, place
from ..fit.losses import l1
from ..fit.presets import Start
from ..fit.settings import MIXED, kinds_of
from ..fit.ssim import Dissimilarity
from ..layer import Formula, Part
from ..lower.block import dependent, derivatives
from ..metrics import ssim
from ..render import fused, kernels, reference
from ..render.tensors import SceneTensors
from ..shapes import KINDS
from ..threads import threads_of_its_own
from .chains import chains


def picture(side: int) -> torch.Tensor:
    """Soft stripes and discs, [3, side, side]."""
    y, x = torch.meshgrid(*(torch.linspace(-0.5, 0.5, side),) * 2, indexing="ij")
    waves = [0.5 + 0.5 * torch.sin(a * x + b * y + 9 * x * y) for a, b in ((20, 7), (-9, 23), (13, -17))]
    discs = torch.sigmoid((0.3 - torch.hypot(x - 0.1, y)) * 60)
    return torch.stack([wave * (0.6 + 0.4 * discs) for wave in waves])


def scene(kinds: Sequence[str], count: int, target: torch.Tensor, compositing: str = "over") -> SceneTensors:
    """What a fit starts with."""
    layers = Layers(tuple(kinds), compositing)
    return place(target, (1.0, 1.0), layers, count, Start(), torch.Generator().manual_seed(0))


def seconds(run: Callable[[], object], least: float = 1.0) -> float:
    """Median time of a call, after one to warm up."""
    run()
    times: list[float] = []
    while sum(times) < least or len(times) < 3:
        started = time.perf_counter()
        run()
        times.append(time.perf_counter() - started)
    return float(np.median(times))


def step(tensors: SceneTensors, target: torch.Tensor, dense: bool) -> Callable[[], object]:
    """One step of a fit: forward, loss (L1 and SSIM), backward, update."""
    optimizer = adam_over(tensors)
    height, width = target.shape[1:]
    fast, absolute = Dissimilarity(target), l1(target)

    def run() -> None:
        optimizer.zero_grad()
        if dense:
            image = reference.composite(tensors, width, height)[:3]
            loss = 0.8 * absolute(image) + 0.2 * (1 - ssim(image, target))
        else:
            image = fused.composite(tensors, width, height, 3)
            loss = 0.8 * absolute(image) + 0.2 * fast(image)
        loss.backward()
        optimizer.step(0.0)  # the same scene again and again

    return run


def against_dense() -> Iterator[str]:
    """A step of a fit, fused and dense, in one run."""
    yield "| kind | dense ms | fused ms | times faster |"
    yield "|---|---:|---:|---:|"
    target = picture(256)
    for kind in (*KINDS, MIXED):
        kinds = kinds_of(kind)
        slow = seconds(step(scene(kinds, 256, target), target, dense=True), least=0.1)
        with threads_of_its_own():
            fast = seconds(step(scene(kinds, 256, target), target, dense=False))
        yield f"| {kind} | {slow * 1e3:.0f} | {fast * 1e3:.1f} | {slow / fast:.0f} |"


def per_shape_pixel() -> Iterator[str]:
    """Forward and backward on one thread, all overhead included."""
    peak = multiply_add_peak()
    yield f"Measured peak of this core: {peak:.0f} billion float32 operations a second (a multiply-add is two)."
    yield ""
    yield "| kind | step ms | ns per pixel in the extents | ns per covered pixel | share of the peak |"
    yield "|---|---:|---:|---:|---:|"
    target = picture(256)
    os.environ["SDF2VEC_THREADS"] = "1"
    for kind in KINDS:
        tensors = scene((kind,), 256, target)
        weights = torch.randn(3, 256, 256, generator=torch.Generator().manual_seed(0))
        for group in tensors.groups:
            for tensor in group.values.values():
                tensor.requires_grad_()

        def run(tensors: SceneTensors = tensors, weights: torch.Tensor = weights) -> None:
            fused.composite(tensors, 256, 256, 3).backward(weights)

        with threads_of_its_own():
            spent = seconds(run)
        inside, covered = pixels_in_extents(tensors, 256), covered_pixels(tensors, 256)
        share = operations(kind) * inside / spent / 1e9 / peak
        per = f"{spent / inside * 1e9:.1f} | {spent / covered * 1e9:.1f}"
        yield f"| {kind} | {spent * 1e3:.2f} | {per} | {share:.0%} |"
    del os.environ["SDF2VEC_THREADS"]


def covered_pixels(tensors: SceneTensors, side: int) -> int:
    """Pairs of a layer and a pixel with a coverage above 0."""
    cover, _ = reference.layers_at(tensors, *reference.canvas(tensors, side, side))
    return int((cover != 0).sum())


def pixels_in_extents(tensors: SceneTensors, side: int) -> float:
    """Pairs of a layer and a pixel of the canvas in the layer's bounding box; squares have sides of 1."""
    low, high = (edge.clamp(-0.5, 0.5) * side for edge in fused.extents_of(tensors, side, side))
    return float((high - low).clamp(min=0).prod(dim=1).sum())


def operations(kind: str) -> int:
    """Float operations per pixel of a step: the layer drawn twice, and its derivatives."""
    block = kernels.drawn(Formula.of((Part(kind),)), "layer", OVER, 3)
    found = derivatives(block, kernels.carried(3))
    inner = dependent((*found.sums, *found.carried), (*block.varying, *found.cotangents))
    drawn = sum(map(_weight, dependent(block.outputs, block.varying)))
    return 2 * drawn + sum(map(_weight, inner)) + len(found.sums)


def _weight(node: Expr) -> int:
    """How many operations the kernels spend on a node; a division or a square root counts as one."""
    return {"var": 0, "sigmoid": 27, "sin": 20, "exp": 22, "mix": 3, "clamp": 2}.get(node.op, 1)


def multiply_add_peak() -> float:
    """Billions of float32 operations per second of one core."""
    x, rounds = np.full(1024, 0.25, np.float32), 1000
    return 2 * 8 * 16 * x.size * rounds / seconds(lambda: chains(x, rounds)) / 1e9


@dataclass(frozen=True)
class Grown:
    """One step of a fit at some size, in milliseconds; layers listed for a tile; peak memory of the process."""

    shapes: int
    side: int
    milliseconds: float
    depth: float
    megabytes: float


def growth() -> Iterator[Grown]:
    """A step by number of shapes and picture size, triangles."""
    for count in (64, 256, 1024, 4096, 8192):
        for side in (128, 256, 512, 1024):
            target = picture(side)
            tensors = scene(("triangle",), count, target)
            with threads_of_its_own():
                spent = seconds(step(tensors, target, dense=False), least=0.3)
                bins = fused.bins_of(tensors, side, side)
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            yield Grown(count, side, spent * 1e3, len(bins.layers) / (len(bins.starts) - 1), peak)
