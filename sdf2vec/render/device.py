"""Where a fit computes, and with which renderer: fused kernels on the CPU or on CUDA, culled torch elsewhere."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec

import torch

from ..errors import Sdf2vecError
from ..scene import Layer, Scene, Shape
from . import culled, fused
from .tensors import SceneTensors, from_scene

Composite = Callable[[SceneTensors, int, int, int], torch.Tensor]


@dataclass(frozen=True)
class Device:
    """`name` is torch's; `composite` renders premultiplied RGB(A), [channels, height, width]."""

    name: str
    composite: Composite


def choose(name: str) -> Device:
    """The device of this name; "auto" is CUDA where its kernels run, else the CPU.

    Raises Sdf2vecError for a device that torch doesn't have here.
    """
    if name == "auto":
        return _cuda_that_works() or Device("cpu", fused.composite)
    if name == "cpu":
        return Device("cpu", fused.composite)
    if name == "cuda" and torch.cuda.is_available():
        return _cuda_that_works() or Device("cuda", culled.composite)
    if name == "mps" and torch.backends.mps.is_available():
        return Device("mps", culled.composite)
    raise Sdf2vecError(
        f"no {name} device here: this PyTorch ({torch.__version__}) does not see one; use --device cpu"
    )


@cache
def _cuda_that_works() -> Device | None:
    """CUDA with the generated kernels, after one of them has run; a driver or a compiler may be wrong for it."""
    if not torch.cuda.is_available() or find_spec("triton") is None:
        return None
    from . import triton_fused

    try:
        triton_fused.composite(_probe("cuda"), 8, 8, 3).sum().backward()
    except (
        Exception
    ) as error:  # of any kind: from the driver, the compiler that Triton calls, or Triton itself
        reason = str(error).strip().partition("\n")[0]
        warnings.warn(f"CUDA's kernels don't run here ({reason})", RuntimeWarning, stacklevel=2)
        return None
    return Device("cuda", triton_fused.composite)


def _probe(device: str) -> SceneTensors:
    """A scene of one circle, to see whether anything comes out."""
    circle = Shape.of("circle", (0.5, 0.5, 0.5), center=(0.0, 0.0), radius=0.3)
    tensors = from_scene(Scene(8, 8, (Layer((circle,), 0.1),), (0.0, 0.0, 0.0)), device=device)
    tensors.background.requires_grad_()
    return tensors
