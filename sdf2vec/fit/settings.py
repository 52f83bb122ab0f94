"""What to fit and how, checked before any work is done. Nothing here needs torch."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

from msgspec import Struct, structs

from ..blend import COMPOSITING
from ..declared import check_choice, checked, choice, number, plain
from ..deferred import deferred
from ..errors import Sdf2vecError
from ..paints import FLAT, PAINTS
from ..scene import MAX_JOINED, MAX_SHAPES, Color, Scene
from ..scene_file import load as load_scene
from ..shapes import KINDS
from .presets import DEFAULT, GRADED, PRESETS, SOFTEST, Loss, Preset

MIXED = "mixed"
LOSS_NAMES = ("l1", "mse", "ssim", "flip")
DEVICES = ("auto", "cpu", "cuda", "mps")
MOST_COLORS = 256
LARGEST_AREA = 0.1  # share of the canvas


AUTO: Literal["auto"] = "auto"
# what drawings are made of, unless kinds are given
DRAWN = ("circle", "ellipse", "box", "triangle", "rounded_triangle", "arc")
PAINTED = ("triangle",)  # what else is, unless kinds are given

Shapes = (
    Annotated[
        int,
        number(
            "number of shapes",
            "N|auto",
            1,
            MAX_SHAPES,
            "how many shapes; auto: no more than the picture needs, or as many as the start has",
        ),
    ]
    | Literal["auto"]
)
MaxShapes = Annotated[
    int, number("largest number of shapes", "N", 1, MAX_SHAPES, "with --shapes auto, at most so many")
]
TargetPsnr = Annotated[
    float,
    number(
        "wanted PSNR (dB)", "DB", 1, 100, "with --shapes auto, as few shapes as come so near to the picture"
    ),
]
TargetFlip = Annotated[
    float, number("wanted FLIP", "FLIP", 0, 1, "the same, by FLIP: 0 for what looks the same")
]
Seed = Annotated[int, number("seed", "S", 0, 2**63 - 1, "the same seed gives the same scene")]
Union = Annotated[
    int, number("number of shapes joined (union)", "K", 1, MAX_JOINED, "join K shapes smoothly in each layer")
]
MinArea = Annotated[
    float, number("least area (share of the canvas)", "SHARE", 0, LARGEST_AREA, "least area, of the canvas")
]
MaxFalloff = Annotated[
    float,
    number(
        "largest falloff (share of the shortest side)",
        "SHARE",
        0,
        SOFTEST,
        "softest edge, of the shortest side: 0 for sharp shapes",
    ),
]
Trials = Annotated[
    int, number("number of trials", "T", 0, 10_000, "try a few shapes elsewhere at the end, T times")
]
Cuts = Annotated[
    int,
    number(
        "number of cuts",
        "N",
        0,
        10_000,
        "try to cut a shape from a layer, or join one to it, at the end, N times",
    ),
]
Colors = Annotated[int, number("number of colours", "K", 1, MOST_COLORS, "how many colours there may be")]


class Settings(Struct, frozen=True):
    """What to fit and how: the options of a fit, read. `weights`: how much an error matters, 0..1, [H, W]."""

    shapes: Shapes = AUTO
    kind: Annotated[
        tuple[str, ...],
        choice(
            "kind",
            "which shapes, one kind or several: box,circle; unless told triangle, and whatever a drawing is made of",
            (*KINDS, MIXED),
        ),
    ] = ()
    compositing: Annotated[str, choice("compositing", "how shapes lie on each other", COMPOSITING)] = "over"
    preset: Annotated[str, choice("preset", "how long to fit, and in which steps", PRESETS)] = DEFAULT
    loss: Annotated[
        Loss | None, choice("loss", "instead of the preset's, one or several: l1:0.8,ssim:0.2", LOSS_NAMES)
    ] = None
    seed: Seed = 0
    device: Annotated[str, choice("device", "where to fit; auto takes CUDA if it works", DEVICES)] = "auto"
    union: Union = 1
    paint: Annotated[str, choice("paint", "what a shape's colour does across it", PAINTS)] = FLAT
    min_area: MinArea | None = None
    max_falloff: MaxFalloff | None = None
    start: Annotated[Scene | None, plain("a scene, or its file, to go on from, at any size", "SCENE")] = None
    trials: Trials = 0
    cuts: Cuts = 0
    palette: Annotated[
        tuple[Color, ...], plain('the only colours there may be: "#123,#a0b1c2"', "COLORS")
    ] = ()
    colors: Colors | None = None
    weights: Annotated[Any, plain("a picture that is bright where errors matter", "MASK")] = None
    max_shapes: MaxShapes = 256
    target_psnr: TargetPsnr | None = None
    target_flip: TargetFlip | None = None

    @property
    def most(self) -> int:
        """How many shapes there are at most; exactly so many unless that is to be found out."""
        return self.max_shapes if self.shapes == AUTO else self.shapes

    @property
    def has_target(self) -> bool:
        """Whether it is told how near a fit is to come."""
        return (self.target_psnr, self.target_flip) != (None, None)

    @property
    def kinds(self) -> tuple[str, ...]:
        """What a picture that is no drawing is painted with."""
        return self.kind or PAINTED

    @property
    def drawn_kinds(self) -> tuple[str, ...]:
        """What a drawing may be made of: shapes with an edge."""
        return tuple(name for name in self.kind or DRAWN if KINDS[name].patch is None)


def preset_of(settings: Settings) -> Preset:
    """The preset with what the settings replace. Raises Sdf2vecError where it is for another compositing."""
    preset = PRESETS[settings.preset]
    if preset.compositing not in (None, settings.compositing):
        raise Sdf2vecError(f"the preset {settings.preset} is for --compositing {preset.compositing}")
    if settings.loss is not None:
        preset = replace(preset, phases=tuple(replace(p, loss=settings.loss) for p in preset.phases))
    if not PAINTS[settings.paint].is_flat:
        preset = preset.paced(GRADED)
    if settings.min_area is not None:
        preset = replace(preset, least_area=settings.min_area)
    if settings.max_falloff is not None:
        low, high = preset.falloff
        preset = replace(preset, falloff=(min(low, settings.max_falloff), min(high, settings.max_falloff)))
    return preset


def settings_of(
    shapes: int | Literal["auto"] | None = None, *, compositing: str | None = None, **options: Any
) -> Settings:
    """The settings of a fit in the words of the user (see `api.fit`). Raises Sdf2vecError for the first bad one."""
    given = {name: READERS[name](value) if name in READERS else value for name, value in options.items()}
    start: Scene | None = given.get("start")
    count = shapes if shapes is not None or start is None else start.shape_count or None
    asked = {"shapes": count, "compositing": compositing}
    settings = checked(Settings, given | {name: value for name, value in asked.items() if value is not None})
    if start is not None and compositing not in (None, start.compositing):
        raise Sdf2vecError(f"the start scene is {start.compositing}, not {compositing}")
    needed = start.compositing if start is not None else PRESETS[settings.preset].compositing
    settings = structs.replace(settings, compositing=compositing or needed or settings.compositing)
    _check_together(settings)
    return settings


def _check_together(settings: Settings) -> None:
    """Raises Sdf2vecError for settings that don't go with each other."""
    shapes, union = settings.most, settings.union
    if settings.shapes != AUTO and (settings.target_psnr, settings.target_flip) != (None, None):
        raise Sdf2vecError("either a number of shapes or a target, not both: --shapes auto finds the number")
    if shapes % union:
        raise Sdf2vecError(f"{shapes} shapes can't be joined by {union}: choose a multiple of {union}")
    if settings.cuts and all(KINDS[name].patch is not None for name in settings.kinds):
        raise Sdf2vecError(
            f"cuts need a kind of shape that can be joined with others, got {', '.join(settings.kinds)}"
        )
    preset_of(settings)
    if settings.palette and settings.colors:
        raise Sdf2vecError("either a palette or a number of colours, not both")
    if settings.compositing != "over" and (settings.palette or settings.colors):
        raise Sdf2vecError("a palette needs --compositing over: additive colours mix")


def _scene_of(start: Any) -> Scene | None:
    if start is None or isinstance(start, Scene):
        return start
    if not isinstance(start, str | os.PathLike):
        raise Sdf2vecError(f"the start is a scene or the path of its file, got {type(start).__name__}")
    return load_scene(start)


def _listed(what: str, value: Any) -> list[Any]:
    """One text, or several things. Raises Sdf2vecError for anything else."""
    if isinstance(value, str):
        return [value]
    if not isinstance(value, Iterable):
        raise Sdf2vecError(f"unknown {what} {value!r}")
    return list(value)


def palette_of(palette: str | Sequence[Color | str] | None) -> tuple[Color, ...]:
    """Colours 0..1 from "#123,#a0b1c2" or from tuples. Raises Sdf2vecError for what is no colour."""
    if palette is None:
        return ()
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


def kinds_of(kind: str | Sequence[str]) -> tuple[str, ...]:
    """Names of kinds from a text like "box,circle", from several names, or "mixed" for all with an edge.

    Raises Sdf2vecError for an unknown one.
    """
    names = [part.strip() for text in _listed("kind", kind) for part in str(text).split(",") if part.strip()]
    for name in names:
        check_choice("kind", name, (*KINDS, MIXED))
    if not names:
        raise Sdf2vecError("at least one kind of shape is needed")
    return tuple(
        name for name, kind in KINDS.items() if name in names or (MIXED in names and kind.patch is None)
    )


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


READERS: dict[str, Callable[[Any], Any]] = {
    "kind": kinds_of,
    "loss": losses_of,
    "start": _scene_of,
    "palette": palette_of,
    "weights": deferred("sdf2vec.fit.weights", "weights_of"),
}
