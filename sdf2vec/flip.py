"""FLIP: how different two pictures look when one alternates with the other, 0..1 at every pixel.

P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, "FLIP: A Difference
Evaluator for Alternating Images", Proceedings of the ACM on Computer Graphics and Interactive Techniques 3(2),
2020. Comments name the steps as the paper does. This is LDR-FLIP as NVIDIA's `flip-evaluator` computes it, for
any floating type and device.

A picture with alpha, [4, H, W] premultiplied, is seen over black and over white, and the two errors are averaged.

`SMOOTH` makes a training loss of it. Exact FLIP has infinite derivatives where the pictures or their features are
equal, and none wherever it clamps. So

- clamps (of colours outside 0..1, and of what the filters lead out of gamut) pass derivatives as if they were not
  there;
- below a softness, a power less than 1 becomes the parabola through 0 that continues it with the same slope, and
  the length of a vector is rounded at 0.

The derivative is finite everywhere, and 0 where the pictures are equal.

What happens at each pixel is written as expressions, which torch runs here and the CPU's loss compiles (`fit.flip`);
what lies between pixels are linear filters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import torch
import torch.nn.functional as F  # noqa: N812
from torch import Tensor

from .expr import Expr, Operand, const, constant, exp, fixed, log, maximum, minimum, select, sqrt, var
from .lower.torch import Tensors, compile_torch
from .metrics import comparable

# --- the paper's constants ----------------------------------------------------------------------------------

PIXELS_PER_DEGREE = 0.7 * 3840 / 0.7 * math.pi / 180  # 0.7 m from a screen 0.7 m wide with 3840 pixels: 67.02

# Colour pipeline, spatial filtering: contrast sensitivities, Σ a √(π/b) exp(−π² x² / b) for x in degrees.
ACHROMATIC = (1.0, 0.0047)
RED_GREEN = (1.0, 0.0053)
BLUE_YELLOW = (34.1, 0.04), (13.5, 0.025)
# Colour pipeline, colour metric.
COLOR_EXPONENT = 0.7  # q_c
TURNING_SHARE, TURNING_ERROR = 0.4, 0.95  # p_c, p_t: this share of the largest distance becomes this error
# Feature pipeline.
FEATURE_WIDTH = 0.082  # w, degrees: of the Gaussian, 2 standard deviations
FEATURE_EXPONENT = 0.5  # q_f

REACH = 3  # standard deviations that a filter extends from its centre

# Linear sRGB to XYZ relative to D65, which has all three 1: every row sums to 1.
_XYZ = (
    (10135552 / 23359437, 8788810 / 23359437, 4435075 / 23359437),
    (2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897),
    (1425312 / 80288307, 8788810 / 80288307, 70074185 / 80288307),
)
# XYZ to Y, Cx, Cz short of their factors and offset, which the way back from the filters takes off again.
_OPPONENT = ((0.0, 1.0, 0.0), (1.0, -1.0, 0.0), (0.0, 1.0, -1.0))
_Y, _CX, _CZ = 0, 1, 2
LAB_DELTA, LAB_OFFSET = 6 / 29, 4 / 29  # CIELAB: a cube root above δ³, a line below


class Softness(NamedTuple):
    """The size below which FLIP is smoothed: of distances in CIELAB units, of differences between features."""

    color: float
    feature: float


EXACT = Softness(1e-7, 1e-12)  # only keeps derivatives finite
SMOOTH = Softness(2e-3, 1e-4)


class Appearance(NamedTuple):
    """What FLIP compares of a picture, over each of B grounds."""

    lab: Tensor  # [B, 3, H, W] what the eye sees of the colours; CIELAB with the Hunt effect
    features: Tensor  # [B, 2, H, W] strength of edges and of points


def flip(image: Tensor, reference: Tensor) -> Tensor:
    """Mean FLIP, 0..1, 0 for equal pictures: a 0-dimensional tensor.

    Both [3, H, W], sRGB-coded, clamped to 0..1; or [4, H, W] premultiplied. Seen at 67 pixels per degree.
    Raises ValueError for other shapes and when they differ.
    """
    return flip_map(image, reference).mean()


def flip_map(image: Tensor, reference: Tensor) -> Tensor:
    """FLIP at every pixel, [H, W]; see `flip`."""
    image, reference = comparable(image, reference)
    return error(appearance(image, EXACT), appearance(reference, EXACT), EXACT).mean(dim=0)


def appearance(image: Tensor, softness: Softness) -> Appearance:
    """What FLIP compares of [3, H, W], or of [4, H, W] premultiplied. Raises ValueError for another shape."""
    light = _compiled((linear(CODED),), (CODED,))(over_grounds(image))[0]
    planes = filters_for(image.dtype, image.device)(light)  # [B, 8, H, W]
    parts = _compiled(seen(PLANES, SOFTNESS[1]), (*PLANES, SOFTNESS[1]))(
        *planes.unbind(dim=1), softness.feature
    )
    return Appearance(torch.stack(parts[:3], dim=1), torch.stack(parts[3:], dim=1))


def error(a: Appearance, b: Appearance, softness: Softness) -> Tensor:
    """The final difference, [B, H, W]: the colour error, raised to 1 − the feature error."""
    numbers = (part for x in (a, b) for planes in x for part in planes.unbind(dim=1))
    inputs = (*LOOK, *OTHER_LOOK, *SOFTNESS)
    found: Tensor = _compiled((difference(LOOK, OTHER_LOOK, *SOFTNESS),), inputs)(*numbers, *softness)[0]
    return found


def over_grounds(image: Tensor) -> Tensor:
    """[1, 3, H, W]; with alpha [2, 3, H, W], over black and over white."""
    if image.ndim != 3 or image.shape[0] not in (3, 4):
        raise ValueError(f"need [3, H, W] or [4, H, W], got {tuple(image.shape)}")
    color, alpha = image[:3], image[3:]
    return torch.stack([color, color + (1 - alpha)]) if len(alpha) else color[None]


# --- what happens at a pixel, as expressions ------------------------------------------------------------------

Look = tuple[Expr, ...]  # of a pixel: the five numbers of `Appearance`


def linear(coded: Expr) -> Expr:
    """Linear light of an sRGB-coded value (IEC 61966-2-1), clamped to 0..1."""
    value = _clamped(coded)
    power = _power((maximum(value, 0.04045) + 0.055) / 1.055, 2.4)
    return select(value > 0.04045, power, value / 12.92)


def seen(planes: Sequence[Expr], softness: Expr) -> Look:
    """How a pixel looks, by what the eight filters give there; `softness` of features."""
    brightness, red_green, wide, narrow = planes[:4]
    opponent = brightness, red_green, wide + narrow
    colors = [_clamped(value) for value in _mixed(_to_rgb().tolist(), opponent)]
    edge, point = (_length(planes[i], planes[i + 1], softness) for i in (4, 6))
    return (*_lab(_mixed(_XYZ, colors)), edge, point)


def difference(a: Look, b: Look, color_softness: Expr, feature_softness: Expr) -> Expr:
    """FLIP of a pixel by how it looks in the two pictures."""
    features = maximum(*(_magnitude(a[i] - b[i]) for i in (4, 3))) * math.sqrt(0.5)
    exponent = 1.0 - _soft_power(features, FEATURE_EXPONENT, feature_softness)
    distance = _hyab(a, b, color_softness)
    large = _redistributed(_power(maximum(distance, color_softness), COLOR_EXPONENT))
    return _power(large, exponent) * _toe(distance, COLOR_EXPONENT * exponent, color_softness)


def _clamped(value: Expr) -> Expr:
    """Clamped to 0..1, with the derivative of what was not clamped."""
    return fixed(minimum(maximum(value, 0.0), 1.0)) + (value - fixed(value))


def _mixed(matrix: Sequence[Sequence[float]], vector: Sequence[Expr]) -> list[Expr]:
    """A vector by a matrix."""
    return [sum((x * weight for weight, x in zip(row, vector, strict=True)), const(0.0)) for row in matrix]


def _lab(xyz: Sequence[Expr]) -> Look:
    """CIELAB of XYZ relative to white, with the Hunt effect: colours fade with lightness."""
    dark = 1 / (3 * LAB_DELTA**2)
    x, y, z = (
        select(v > LAB_DELTA**3, _power(maximum(v, LAB_DELTA**3), 1 / 3), v * dark + LAB_OFFSET) for v in xyz
    )
    lightness = 116.0 * y - 16.0
    return lightness, 5.0 * lightness * (x - y), 2.0 * lightness * (y - z)


def _hyab(a: Look, b: Look, softness: Operand) -> Expr:
    """The distance of two colours in CIELAB: along lightness, and across."""
    return _magnitude(a[0] - b[0]) + _length(a[1] - b[1], a[2] - b[2], softness)


def _redistributed(powered: Expr) -> Expr:
    """Colour distances, to the power of q_c, mapped to 0..1: most of the range to the small ones."""
    largest = largest_distance() ** COLOR_EXPONENT
    turn = TURNING_SHARE * largest
    small = powered * (TURNING_ERROR / turn)
    large = TURNING_ERROR + (powered - turn) * ((1 - TURNING_ERROR) / (largest - turn))
    return minimum(small, large)  # as the first one is steeper


@cache
def largest_distance() -> float:
    """Between green and blue, by HyAB."""
    _, green, blue = (_lab([const(row[i]) for row in _XYZ]) for i in range(3))
    return constant(_hyab(green, blue, 0.0))


def _power(x: Expr, exponent: Operand) -> Expr:
    return exp(exponent * log(x))


def _soft_power(x: Expr, exponent: float, softness: Expr) -> Expr:
    """x to a power below 1, for x ≥ 0, with a finite slope at 0."""
    return _power(maximum(x, softness), exponent) * _toe(x, exponent, softness)


def _toe(x: Expr, exponent: Operand, softness: Expr) -> Expr:
    """What turns a constant power into a parabola below the softness: 1 above it, 0 at 0."""
    t = minimum(x / softness, 1.0)
    return t * (2.0 - exponent - (1.0 - exponent) * t)


def _magnitude(x: Expr) -> Expr:
    """|x|, with derivative 0 at 0."""
    return x * fixed(select(x > 0.0, 1.0, select(x < 0.0, -1.0, 0.0)))


def _length(x: Expr, y: Expr, softness: Operand) -> Expr:
    """The length of a vector, rounded at 0."""
    return sqrt(x * x + y * y + softness * softness) - softness


CODED = var("coded")
PLANES = tuple(var(f"plane{i}") for i in range(8))
LOOK, OTHER_LOOK = (tuple(var(f"{side}{i}") for i in range(5)) for side in ("look", "other"))
SOFTNESS = var("color_softness"), var("feature_softness")


@cache
def _compiled(outputs: tuple[Expr, ...], inputs: tuple[Expr, ...]) -> Callable[..., Tensors]:
    return compile_torch(outputs, inputs)


# --- filters ------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Filters:
    """All of FLIP's filters, each one across and one down; what lies outside repeats the edge.

    The first four planes are Y, Cx and the two parts of Cz as the eye resolves them, the others the derivatives
    of Y across and down: first order, second order.
    """

    opponents: Tensor  # [8] int64: which of Y, Cx and Cz each plane is of
    to_opponent: Tensor  # [3, 3] from linear RGB
    across: Tensor  # [8, 1, 1, K]
    down: Tensor  # [8, 1, K, 1]

    def __call__(self, linear: Tensor) -> Tensor:
        """[B, 3, H, W] to [B, 8, H, W]."""
        reach = self.across.shape[3] // 2
        padded = _edged(_edged(linear, reach, 2), reach, 3)
        opponent = (self.to_opponent @ padded.flatten(2)).unflatten(2, padded.shape[2:])
        planes: Tensor = opponent[:, self.opponents]
        for kernels in (self.across, self.down):
            planes = F.conv2d(planes, kernels, groups=len(kernels))
        return planes


def _edged(planes: Tensor, reach: int, axis: int) -> Tensor:
    """With the first and the last repeated along an axis: on a GPU the derivative of torch's padding is not the same
    each time.
    """
    ends = (planes.narrow(axis, at, 1) for at in (0, planes.shape[axis] - 1))
    first, last = (end.repeat_interleave(reach, axis) for end in ends)
    return torch.cat([first, planes, last], axis)


@cache
def filters_for(dtype: torch.dtype, device: torch.device) -> Filters:
    """FLIP's filters for pictures of a type on a device."""
    opponents, across, down = zip(*_bank(), strict=True)
    tensors = (
        _to_opponent(),
        torch.stack(across)[:, None, None, :],
        torch.stack(down)[:, None, :, None],
    )
    which = torch.tensor(opponents, device=device)
    return Filters(which, *(tensor.to(device, dtype).contiguous() for tensor in tensors))


def _to_opponent() -> Tensor:
    """From linear RGB, [3, 3]."""
    return torch.tensor(_OPPONENT, dtype=torch.float64) @ torch.tensor(_XYZ, dtype=torch.float64)


def _to_rgb() -> Tensor:
    """Linear RGB from the opponent planes, [3, 3]."""
    inverse: Tensor = torch.linalg.inv(_to_opponent())
    return inverse


def _bank() -> list[tuple[int, Tensor, Tensor]]:
    """The filters: of which opponent plane, kernel across, kernel down; kernels of one length."""
    sensitivities = ACHROMATIC, RED_GREEN, *BLUE_YELLOW
    deviations = [math.sqrt(b / 2) / math.pi * PIXELS_PER_DEGREE for _, b in sensitivities]
    offsets = _offsets(max(deviations))
    y, cx, wide, narrow = (_gaussian(offsets, deviation) for deviation in deviations)
    wide_share, narrow_share = _shares(wide, narrow)
    smooth, first, second = (F.pad(k, [(len(y) - len(k)) // 2] * 2) for k in _feature_kernels())
    return [
        (_Y, _unit(y), _unit(y)),
        (_CX, _unit(cx), _unit(cx)),
        (_CZ, wide_share * _unit(wide), _unit(wide)),
        (_CZ, narrow_share * _unit(narrow), _unit(narrow)),
        (_Y, first, smooth),
        (_Y, smooth, first),
        (_Y, second, smooth),
        (_Y, smooth, second),
    ]


def _shares(wide: Tensor, narrow: Tensor) -> tuple[float, float]:
    """What each of the two Gaussians of Cz has of their sum over the plane."""
    volumes = [
        a * math.sqrt(math.pi / b) * float(kernel.sum()) ** 2
        for (a, b), kernel in zip(BLUE_YELLOW, (wide, narrow), strict=True)
    ]
    return volumes[0] / sum(volumes), volumes[1] / sum(volumes)


def _feature_kernels() -> tuple[Tensor, Tensor, Tensor]:
    """A Gaussian and its derivatives of first and second order."""
    deviation = FEATURE_WIDTH / 2 * PIXELS_PER_DEGREE
    x = _offsets(deviation)
    gaussian = _gaussian(x, deviation)
    first, second = -x * gaussian, ((x / deviation) ** 2 - 1) * gaussian
    return _unit(gaussian), _balanced(first), _balanced(second)


def _offsets(deviation: float) -> Tensor:
    reach = math.ceil(REACH * deviation)
    return torch.arange(-reach, reach + 1, dtype=torch.float64)


def _gaussian(x: Tensor, deviation: float) -> Tensor:
    return torch.exp(-0.5 * (x / deviation) ** 2)


def _unit(kernel: Tensor) -> Tensor:
    return kernel / kernel.sum()


def _balanced(kernel: Tensor) -> Tensor:
    """Positive weights sum to 1, negative ones to −1."""
    rise, fall = kernel.clamp(min=0), kernel.clamp(max=0)
    return rise / rise.sum() - fall / fall.sum()
