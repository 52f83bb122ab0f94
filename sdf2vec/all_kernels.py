"""All kernels that fits of every kind and paint of shape may need."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from .blend import COMPOSITING
from .fit import (
    descent_kernels,
    difference_kernels,
    flip_kernels,
    normal_kernels,
    ssim_kernels,
    stacking_kernels,
)
from .kernel_cache import Assembly, Kernel
from .layer import Part
from .paints import PAINTS
from .render import kernels, tiling
from .shapes import KINDS

LOOPS = (
    tiling,
    difference_kernels,
    ssim_kernels,
    flip_kernels,
    normal_kernels,
    descent_kernels,
    stacking_kernels,
)


def all_kernels() -> Iterator[tuple[str, Sequence[Assembly]]]:
    """What they are for, and the assemblies."""
    loops = [value for module in LOOPS for value in vars(module).values() if isinstance(value, Kernel)]
    yield "loops and losses", [flip_kernels.FORMULAS, *(kernel.assembly for kernel in loops)]
    for kind in KINDS:
        for paint in PAINTS:
            structure = (Part(kind, paint),)
            drawings = [
                kernels.drawing(structure, mode, channels) for mode in COMPOSITING for channels in (3, 4)
            ]
            entries = [entry for each in (*drawings, kernels.measuring(structure)) for entry in each]
            yield f"{kind}, {paint}", list(dict.fromkeys(entry.assembly for entry in entries))
