"""What to fit and how, checked before any work is done. Nothing here needs torch."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..blend import COMPOSITING
from ..errors import Sdf2vecError
from ..image import load as load_picture
from ..image import resize
from ..paints import FLAT
from ..scene import MAX_JOINED, MAX_SHAPES, Color, Scene
from ..scene import load as load_scene
from ..shapes import KINDS
from .presets import DEFAULT, PRESETS, SOFTEST, Loss, Preset

MIXED = "mixed"
LOSS_NAMES = ("l1", "mse", "ssim", "flip")
DEVICES = ("auto", "cpu", "cuda", "mps")
MOST_COLORS = 256
SHAPES = 256  # when nobody says how many
LARGEST_AREA = 0.1  # share of the canvas


@dataclass(frozen=True)
class Settings:
    """What to fit and how.

    `kinds`: names in `shapes.KINDS`; `union`: shapes joined in each layer; `loss`: replaces the preset's, when given;
    `least_area`: of a shape, in shares of the canvas, None leaves it to the preset; `softest`: the largest falloff, in
    scene units, 0 for sharp edges only, None leaves it to the preset; `start`: a scene to go on from, at any size;
    `trials`: how often a few layers are tried elsewhere at the end; `palette`: the only colours there may be; `colors`:
    how many there may be where no palette is given, 0 for any; `weights`: how much an error matters, 0..1, [H, W];
    `device`: auto, cpu, cuda or mps; `cuts`: how often it is tried to join a shape to a layer at the end.
    """

    shapes: int = 256
    kinds: tuple[str, ...] = ("triangle",)
    compositing: str = "over"
    preset: str = DEFAULT
    loss: Loss | None = None
    seed: int = 0
    device: str = "auto"
    union: int = 1
    least_area: float | None = None
    softest: float | None = None
    start: Scene | None = None
    trials: int = 0
    palette: tuple[Color, ...] = ()
    colors: int = 0
    weights: NDArray[np.float32] | None = field(default=None, compare=False)
    paint: str = FLAT
    cuts: int = 0


def preset_of(settings: Settings) -> Preset:
    """The preset with what the settings replace. Raises Sdf2vecError where it is for another compositing."""
    preset = PRESETS[settings.preset]
    if preset.compositing not in (None, settings.compositing):
        raise Sdf2vecError(f"the preset {settings.preset} is for --compositing {preset.compositing}")
    if settings.loss is not None:
        preset = replace(preset, phases=tuple(replace(p, loss=settings.loss) for p in preset.phases))
    if settings.least_area is not None:
        preset = replace(preset, least_area=settings.least_area)
    if settings.softest is not None:
        low, high = preset.falloff
        preset = replace(preset, falloff=(min(low, settings.softest), min(high, settings.softest)))
    return preset


def settings_of(
    shapes: int | None = None,
    *,
    kind: str | Sequence[str] = "triangle",
    compositing: str | None = None,
    preset: str = DEFAULT,
    loss: str | Sequence[tuple[str, float]] | None = None,
    seed: int = 0,
    device: str = "auto",
    union: int = 1,
    min_area: float | None = None,
    max_falloff: float | None = None,
    start: Any = None,
    trials: int = 0,
    palette: str | Sequence[Color | str] | None = None,
    colors: int | None = None,
    weights: Any = None,
    cuts: int = 0,
) -> Settings:
    """The settings of a fit in the words of the user (see `api.fit`). Raises Sdf2vecError for the first bad one."""
    kinds = kinds_of(kind)
    check_choice("preset", preset, tuple(PRESETS))
    check_choice("device", device, DEVICES)
    _check_whole("seed", seed, 0, 2**63 - 1)
    _check_whole("number of shapes joined (union)", union, 1, MAX_JOINED)
    _check_whole("number of trials", trials, 0, 10_000)
    _check_whole("number of cuts", cuts, 0, 10_000)
    if cuts and all(KINDS[name].patch is not None for name in kinds):
        raise Sdf2vecError(
            f"cuts need a kind of shape that can be joined with others, got {', '.join(kinds)}"
        )
    scene = _scene_of(start)
    shapes = _count_of(shapes, scene)
    if shapes % union:
        raise Sdf2vecError(f"{shapes} shapes can't be joined by {union}: choose a multiple of {union}")
    settings = Settings(
        shapes,
        kinds,
        _compositing(compositing, preset, scene),
        preset,
        losses_of(loss),
        int(seed),
        device,
        int(union),
        _share_of(min_area, "least area", "canvas", LARGEST_AREA),
        _share_of(max_falloff, "largest falloff", "shortest side", SOFTEST),
        scene,
        int(trials),
        *_colors(palette, colors),
        weights_of(weights),
        cuts=int(cuts),
    )
    preset_of(settings)
    if settings.compositing != "over" and (settings.palette or settings.colors):
        raise Sdf2vecError("a palette needs --compositing over: additive colours mix")
    return settings


def _scene_of(start: Any) -> Scene | None:
    if start is None or isinstance(start, Scene):
        return start
    if not isinstance(start, str | os.PathLike):
        raise Sdf2vecError(f"the start is a scene or the path of its file, got {type(start).__name__}")
    return load_scene(start)


def _count_of(shapes: int | None, start: Scene | None) -> int:
    if shapes is None:
        return start.shape_count if start is not None and start.shape_count else SHAPES
    _check_whole("number of shapes", shapes, 1, MAX_SHAPES)
    return int(shapes)


def _share_of(value: Any, what: str, whole: str, most: float) -> float | None:
    """A share of something, None for None. Raises Sdf2vecError for what is out of range or no number."""
    try:
        if value is None or 0 <= value <= most:
            return value if value is None else float(value)
    except (TypeError, ValueError):
        pass
    raise Sdf2vecError(f"the {what} must be a share of the {whole} up to {most}, got {value!r}")


def _listed(what: str, value: Any) -> list[Any]:
    """One text, or several things. Raises Sdf2vecError for anything else."""
    if isinstance(value, str):
        return [value]
    if not isinstance(value, Iterable):
        raise Sdf2vecError(f"unknown {what} {value!r}")
    return list(value)


def _compositing(asked: str | None, preset: str, start: Scene | None) -> str:
    """What was asked for, or what the start scene or the preset needs, or over."""
    if asked is not None:
        check_choice("compositing", asked, tuple(COMPOSITING))
    if start is not None and asked not in (None, start.compositing):
        raise Sdf2vecError(f"the start scene is {start.compositing}, not {asked}")
    return (
        asked or (start.compositing if start is not None else None) or PRESETS[preset].compositing or "over"
    )


def _colors(palette: str | Sequence[Color | str] | None, count: int | None) -> tuple[tuple[Color, ...], int]:
    if palette is not None and count is not None:
        raise Sdf2vecError("either a palette or a number of colours, not both")
    if count is not None:
        _check_whole("number of colours", count, 1, MOST_COLORS)
        return (), int(count)
    return (palette_of(palette) if palette is not None else ()), 0


def palette_of(palette: str | Sequence[Color | str]) -> tuple[Color, ...]:
    """Colours 0..1 from "#123,#a0b1c2" or from tuples. Raises Sdf2vecError for what is no colour."""
    parts = (
        [part.strip() for part in palette.split(",")]
        if isinstance(palette, str)
        else _listed("palette", palette)
    )
    if not parts:
        raise Sdf2vecError("a palette needs at least one colour")
    return tuple(map(_color, parts))


def _color(part: str | Color) -> Color:
    if isinstance(part, str):
        if not re.fullmatch(r"#([0-9a-fA-F]{3}|[0-9a-fA-F]{6})", part):
            raise Sdf2vecError(f"a colour of a palette is #rgb or #rrggbb, got {part!r}")
        digits = part[1:] if len(part) == 7 else "".join(digit * 2 for digit in part[1:])
        levels = bytes.fromhex(digits)
        return levels[0] / 255, levels[1] / 255, levels[2] / 255
    try:
        red, green, blue = (float(value) for value in part)
    except (TypeError, ValueError):
        raise Sdf2vecError(f"a colour of a palette is three numbers 0..1, got {part!r}") from None
    if not all(0 <= value <= 1 for value in (red, green, blue)):
        raise Sdf2vecError(f"a colour of a palette is three numbers 0..1, got {part!r}")
    return red, green, blue


def weights_of(source: Any) -> NDArray[np.float32] | None:
    """How much an error matters, 0..1, [H, W]: a picture's mean channel, less where it is transparent."""
    if source is None:
        return None
    pixels = load_picture(source).pixels
    weights: NDArray[np.float32] = pixels[..., :3].mean(axis=2, dtype=np.float32)
    if pixels.shape[2] == 4:
        weights = weights * pixels[..., 3]
    if weights.max() == 0:
        raise Sdf2vecError("the weights are black all over: nothing would matter")
    return weights


def weights_for(weights: NDArray[np.float32], width: int, height: int) -> NDArray[np.float32]:
    """Weights [H, W] at a picture's size, [height, width]."""
    return np.ascontiguousarray(resize(np.repeat(weights[..., None], 3, axis=2), width, height)[..., 0])


def kinds_of(kind: str | Sequence[str]) -> tuple[str, ...]:
    """Names of kinds from one name, several, or "mixed". Raises Sdf2vecError for an unknown one."""
    names = _listed("kind", kind)
    for name in names:
        check_choice("kind", name, (*KINDS, MIXED))
    if not names:
        raise Sdf2vecError("at least one kind of shape is needed")
    return tuple(kind for kind in KINDS if kind in names or MIXED in names)


def losses_of(loss: str | Sequence[tuple[str, float]] | None) -> Loss | None:
    """Names and weights from a text like "l1:0.8,ssim:0.2", or from pairs; None stays None.

    A name without a weight has the weight 1. Raises Sdf2vecError for what is no loss, and for a loss given twice.
    """
    if loss is None:
        return None
    terms = tuple(map(_term, loss.split(",") if isinstance(loss, str) else _listed("loss", loss)))
    names = [name for name, _ in terms]
    if not names:
        raise Sdf2vecError(f"at least one loss is needed: {', '.join(LOSS_NAMES)}")
    for name in names:
        if names.count(name) > 1:
            raise Sdf2vecError(f"loss {name!r} is given twice")
    return terms


def _term(part: str | tuple[str, float]) -> tuple[str, float]:
    try:
        name, weight = _name_and_weight(part) if isinstance(part, str) else part
        weight = float(weight)
    except (TypeError, ValueError):
        raise Sdf2vecError(f"a loss is given as name or name:weight, got {part!r}") from None
    check_choice("loss", name, LOSS_NAMES)
    if not 0 < weight < math.inf:
        raise Sdf2vecError(f"the weight of loss {name!r} must be positive and finite, got {weight:g}")
    return name, weight


def _name_and_weight(text: str) -> tuple[str, str]:
    name, colon, weight = text.partition(":")
    return name.strip(), weight if colon else "1"


def _check_whole(what: str, value: Any, low: int, high: int) -> None:
    if isinstance(value, bool) or not hasattr(value, "__index__") or not low <= value <= high:
        raise Sdf2vecError(f"the {what} must be a whole number between {low} and {high}, got {value}")


def check_choice(what: str, value: str, known: Sequence[str]) -> None:
    """Raises Sdf2vecError for an unknown name."""
    if value not in known:
        raise Sdf2vecError(f"unknown {what} {value!r}; choose from {', '.join(known)}")
