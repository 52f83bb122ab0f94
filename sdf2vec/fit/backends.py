"""What a fit computes with on each device: a renderer, and the losses that are computed faster there than by torch."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec

import torch

from ..deferred import deferred
from ..errors import Sdf2vecError
from ..render import culled, fused
from ..render.tensors import SceneTensors, from_scene
from ..scene import Layer, Scene, Shape
from .adam import Adam
from .losses import LossMaker
from .steps import Composite, Plain, Steps, Value

StepsMaker = Callable[[Value, Composite, Adam, Callable[[], None]], Steps]


@dataclass(frozen=True)
class Backend:
    """`device` is torch's name; `composite` renders premultiplied RGB(A), [channels, height, width]; `losses` take the
    place of those of their names in `losses.LOSSES`; `is_compiled`: whether kernels for a scene are there; `steps`:
    how the steps of a fit are taken."""

    device: str
    composite: Composite
    losses: Mapping[str, LossMaker] = field(default_factory=dict)
    is_compiled: Callable[[SceneTensors, int], bool] = lambda tensors, channels: True
    steps: StepsMaker = Plain


composite_triton: Composite = deferred("sdf2vec.render.triton_fused", "composite")

CPU = Backend(
    "cpu",
    fused.composite,
    {
        "l1": deferred("sdf2vec.fit.differences", "Absolute"),
        "mse": deferred("sdf2vec.fit.differences", "Squared"),
        "ssim": deferred("sdf2vec.fit.ssim", "Dissimilarity"),
        "flip": deferred("sdf2vec.fit.flip", "Flip"),
    },
    fused.is_compiled,
)
CUDA = Backend("cuda", composite_triton, steps=deferred("sdf2vec.fit.recorded", "Recorded"))
CUDA_BY_TORCH = Backend("cuda", culled.composite)
MPS = Backend("mps", culled.composite)


def choose(name: str) -> Backend:
    """The backend for the device of this name; "auto" is CUDA where its kernels run, else the CPU.

    Raises Sdf2vecError for a device that torch doesn't have here.
    """
    if name == "cpu" or (name == "auto" and not _cuda_works()):
        return CPU
    if name in ("auto", "cuda") and torch.cuda.is_available():
        return CUDA if _cuda_works() else CUDA_BY_TORCH
    if name == "mps" and torch.backends.mps.is_available():
        return MPS
    raise Sdf2vecError(
        f"no {name} device here: this PyTorch ({torch.__version__}) does not see one; use --device cpu"
    )


@cache
def _cuda_works() -> bool:
    """Whether CUDA's generated kernels do: one of them is run, for a driver or a compiler may be wrong for it."""
    if not torch.cuda.is_available() or find_spec("triton") is None:
        return False
    try:
        CUDA.composite(_probe("cuda"), 8, 8, 3).sum().backward()
    except (
        Exception
    ) as error:  # of any kind: from the driver, the compiler that Triton calls, or Triton itself
        reason = str(error).strip().partition("\n")[0]
        warnings.warn(f"CUDA's kernels don't run here ({reason})", RuntimeWarning, stacklevel=2)
        return False
    return True


def _probe(device: str) -> SceneTensors:
    """A scene of one circle, to see whether anything comes out."""
    circle = Shape.of("circle", (0.5, 0.5, 0.5), center=(0.0, 0.0), radius=0.3)
    tensors = from_scene(Scene(8, 8, (Layer((circle,), 0.1),), (0.0, 0.0, 0.0)), device=device)
    tensors.background.requires_grad_()
    return tensors
