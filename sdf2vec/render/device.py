"""Where a fit computes, and with which renderer: fused kernels on the CPU or on CUDA, dense torch elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch

from ..errors import Sdf2vecError
from . import fused, reference
from .tensors import SceneTensors

Composite = Callable[[SceneTensors, int, int, int], torch.Tensor]


@dataclass(frozen=True)
class Device:
    """`name` is torch's; `composite` renders premultiplied RGB(A), [channels, height, width]."""

    name: str
    composite: Composite


def choose(name: str) -> Device:
    """The device of this name. "auto" is the CPU: the other paths have not been measured on real hardware.

    Raises Sdf2vecError for a device that torch doesn't have here.
    """
    if name in ("auto", "cpu"):
        return Device("cpu", fused.composite)
    if name == "cuda" and torch.cuda.is_available():
        return Device("cuda", _on_cuda())
    if name == "mps" and torch.backends.mps.is_available():
        return Device("mps", _dense)
    raise Sdf2vecError(
        f"no {name} device here: this PyTorch ({torch.__version__}) does not see one; use --device cpu"
    )


def _on_cuda() -> Composite:
    from . import triton_fused

    return triton_fused.composite if triton_fused.available() else _dense


def _dense(tensors: SceneTensors, width: int, height: int, channels: int) -> torch.Tensor:
    return reference.composite(tensors, width, height)[:channels]
