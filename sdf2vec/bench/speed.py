"""How fast the fused renderer is. Writes tables in Markdown.

    python -m sdf2vec.bench.speed -o docs/speed.md

Ratios are measured side by side in one run. The picture is made by code.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import torch

from ..files import write_atomically
from ..fit.loop import adam
from ..fit.losses import l1
from ..fit.placing import place
from ..fit.ssim import Dissimilarity
from ..metrics import ssim
from ..render import fused, reference
from ..render.tensors import SceneTensors
from ..shapes import KINDS


def picture(side: int) -> torch.Tensor:
    """Soft stripes and discs, [3, side, side]."""
    y, x = torch.meshgrid(*(torch.linspace(-0.5, 0.5, side),) * 2, indexing="ij")
    waves = [0.5 + 0.5 * torch.sin(a * x + b * y + 9 * x * y) for a, b in ((20, 7), (-9, 23), (13, -17))]
    discs = torch.sigmoid((0.3 - torch.hypot(x - 0.1, y)) * 60)
    return torch.stack([wave * (0.6 + 0.4 * discs) for wave in waves])


def scene(kinds: list[str], count: int, target: torch.Tensor, compositing: str = "over") -> SceneTensors:
    """What a fit starts with."""
    return place(target, (1.0, 1.0), kinds, count, compositing, torch.Generator().manual_seed(0))


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
    optimizer = adam(tensors)
    height, width = target.shape[1:]
    fast, absolute = Dissimilarity(target), l1(target)

    def run() -> None:
        optimizer.zero_grad(set_to_none=True)
        if dense:
            image = reference.composite(tensors, width, height)[:3]
            loss = 0.8 * absolute(image) + 0.2 * (1 - ssim(image, target))
        else:
            image = fused.composite(tensors, width, height, 3)
            loss = 0.8 * absolute(image) + 0.2 * fast(image)
        loss.backward()
        optimizer.step()

    return run


def against_dense() -> Iterator[str]:
    """A step of a fit, fused and dense, in one run."""
    yield "| kind | dense ms | fused ms | times faster |"
    yield "|---|---:|---:|---:|"
    target = picture(256)
    for kind in (*KINDS, "mixed"):
        kinds = list(KINDS) if kind == "mixed" else [kind]
        slow = seconds(step(scene(kinds, 256, target), target, dense=True), least=0.1)
        with fused.threads_of_its_own():
            fast = seconds(step(scene(kinds, 256, target), target, dense=False))
        yield f"| {kind} | {slow * 1e3:.0f} | {fast * 1e3:.1f} | {slow / fast:.0f} |"


def per_shape_pixel() -> Iterator[str]:
    """Forward and backward on one thread, all overhead included, per pixel inside the layers' extents."""
    yield "| kind | ns per shape-pixel, 256 shapes at 256 px |"
    yield "|---|---:|"
    target = picture(256)
    os.environ["SDF2VEC_THREADS"] = "1"
    for kind in KINDS:
        tensors = scene([kind], 256, target)
        weights = torch.randn(3, 256, 256, generator=torch.Generator().manual_seed(0))
        for group in tensors.groups:
            for _, tensor in group.tensors():
                tensor.requires_grad_()

        def run(tensors: SceneTensors = tensors, weights: torch.Tensor = weights) -> None:
            fused.composite(tensors, 256, 256, 3).backward(weights)

        with fused.threads_of_its_own():
            spent = seconds(run)
        yield f"| {kind} | {spent / covered_pixels(tensors, 256, 256) * 1e9:.1f} |"
    del os.environ["SDF2VEC_THREADS"]


def covered_pixels(tensors: SceneTensors, width: int, height: int) -> int:
    """Pairs of a layer and a pixel with a coverage above 0."""
    x, y, pixel = reference.canvas(tensors, width, height)
    with torch.no_grad():
        return sum(int((reference.group_coverage(g, x, y, pixel)[0] > 0).sum()) for g in tensors.groups)


def growth() -> Iterator[str]:
    """A step by number of shapes and picture size, triangles; and the peak memory of the process so far."""
    yield "| shapes | size | step ms | layers a pixel | peak memory MB |"
    yield "|---:|---:|---:|---:|---:|"
    for count in (64, 256, 1024, 4096, 8192):
        for side in (128, 256, 512, 1024):
            target = picture(side)
            tensors = scene(["triangle"], count, target)
            with fused.threads_of_its_own():
                spent = seconds(step(tensors, target, dense=False), least=0.3)
                bins = fused.bins_of(tensors, side, side)
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            depth = len(bins.layers) / (len(bins.starts) - 1)
            yield f"| {count} | {side} | {spent * 1e3:.1f} | {depth:.1f} | {peak:.0f} |"


def page() -> str:
    """All tables. Growth is measured first, before dense torch takes memory."""
    grown = list(growth())
    sections = (
        "# Speed of the fused renderer",
        f"    python -m sdf2vec.bench.speed -o docs/speed.md\n\nOn {fused.available_cores()} CPU cores.",
        "## One step of a fit against the same step in dense torch\n\n256 shapes at 256 × 256, `over`: forward, "
        "L1 and SSIM, backward, Adam.",
        "\n".join(against_dense()),
        "## Time per shape-pixel\n\nForward and backward on one core, all overhead included; a shape-pixel is a "
        "pixel that a shape covers.",
        "\n".join(per_shape_pixel()),
        "## Growth\n\nOne step with triangles, as a fit starts with them; layers a pixel is the mean number of "
        "layers listed for a tile.",
        "\n".join(grown),
    )
    return "\n\n".join(sections) + "\n"


def main() -> None:
    """Entry point of `python -m sdf2vec.bench.speed`."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, required=True)
    write_atomically(parser.parse_args().output, page().encode())


if __name__ == "__main__":
    main()
