"""Where methods of this kind fail: why, the method that fails there, what counts as a failure, and ours beside it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from . import attempts, textbook
from . import hard_pictures as pictures
from .attempts import Attempt, bare_descent, fitted, from_start, thin

SEEDS_DIFFER = "{} of 24 triangles to 40 pixels, beside {}: other seeds alone differ by as much".format
SINGLE, MEAN = (
    SEEDS_DIFFER("one fit", "another one"),
    SEEDS_DIFFER("the mean of three fits", "that of three others"),
)
NEAR, FACTOR_TEN = 1.1, 1.5  # times the FLIP at the default rate


@dataclass(frozen=True)
class Case:
    """An entry. `seeds`: how many the tests try, 0 where one takes seconds; `left`: why ours may fail."""

    name: str
    why: str
    method: str
    judge: str
    theirs: Attempt
    ours: Attempt
    seeds: int = 1
    left: str = ""


DB = "gains less than {} dB on a flat ground".format
BARE = "shapes anywhere, plain Adam"
FINITE = "a value or derivative is no number"

CASES: tuple[Case, ...] = (
    Case(
        "dead gradients",
        "smoothstep is flat outside its band: a shape that covers nothing of what is missing never moves",
        "discs with smoothstep edges, none near the figure",
        DB(3),
        partial(attempts.far_away, edge="smoothstep"),
        fitted(pictures.one_disc, 5, 3.0, kind="circle"),
    ),
    Case(
        "shrinking shapes",
        "a shape in the wrong place loses least by vanishing, and what has no area has no derivative",
        "discs without a least area",
        "a shape is thinner than a pixel",
        thin("circle", guarded=False),
        thin("circle", guarded=True),
    ),
    Case(
        "slivers",
        "a triangle flattens to a line that no pixel sees",
        "triangles without a least thickness",
        "a shape is thinner than a pixel",
        thin("triangle", guarded=False),
        thin("triangle", guarded=True),
    ),
    Case(
        "smooth minimum, large d/k",
        "e^(−d/k) overflows below 0 and underflows above, and the logarithm of 0 follows",
        "−k·log(Σ e^(−d/k)) as it is written, float32",
        f"{FINITE}, or off by 0.01",
        partial(attempts.joined, join=textbook.smooth_minimum),
        partial(attempts.joined, join=attempts.our_union),
        20,
    ),
    Case(
        "singular points",
        "√ at 0, a direction of no length, a triangle that is a point: 0/0 in the derivative",
        "√(x² + y²) − r at the centre; a segment of no length",
        FINITE,
        attempts.textbook_singular,
        attempts.our_singular,
        20,
    ),
    Case(
        "FLIP's clamps",
        "FLIP clamps its pictures to what a screen shows: beyond there is no derivative",
        "FLIP of the clamped picture, as a loss",
        "the derivative is no number, or 0 on half of a picture that is off",
        partial(attempts.flip_slopes, smooth=False),
        partial(attempts.flip_slopes, smooth=True),
        20,
    ),
    Case(
        "saturated pixels",
        "what a clamp on the output cuts off has no derivative: too bright stays too bright",
        "added discs, the output clamped before the loss",
        DB(1),
        partial(attempts.saturated, clamped=True),
        fitted(pictures.dark_discs, 8, 1.0, kind="circle", compositing="additive"),
    ),
    Case(
        "low contrast",
        "a disc of four levels: its loss is small next to any wrong start",
        BARE,
        DB(3),
        bare_descent(pictures.faint, "circle", 5, 3.0),
        fitted(pictures.faint, 5, 3.0, kind="circle"),
    ),
    Case(
        "small and far",
        "a disc of 2.5 pixels in a corner of a plain ground",
        BARE,
        DB(6),
        bare_descent(pictures.far, "circle", 5, 6.0),
        fitted(pictures.far, 5, 6.0, kind="circle"),
    ),
    Case(
        "text and lines",
        "strokes of one pixel: half of a soft shape's pixels are wrong",
        BARE,
        DB(1),
        bare_descent(pictures.lettering, "triangle", 24, 1.0),
        fitted(pictures.lettering, 24, 1.0),
        0,
    ),
    Case(
        "checkerboards, displaced discs",
        "patterns finer than shapes: waves alias into moiré that is worse than grey",
        f"displaced discs: {BARE}",
        "worse than a flat ground",
        bare_descent(pictures.checkerboard, "displaced", 9, -1e-3),
        fitted(pictures.checkerboard, 9, -1e-3, kind="displaced"),
    ),
    Case(
        "checkerboards, Gabor patches",
        "the same with waves of patches",
        f"Gabor patches, added: {BARE}",
        "worse than a flat ground",
        bare_descent(pictures.checkerboard, "gabor", 9, -1e-3, compositing="additive"),
        fitted(pictures.checkerboard, 9, -1e-3, kind="gabor", compositing="additive"),
        0,
    ),
    Case(
        "extreme aspect ratios",
        "a strip of 600 × 2 pixels: rates and sizes made for squares",
        BARE,
        DB(3),
        bare_descent(pictures.strip, "triangle", 16, 3.0),
        fitted(pictures.strip, 16, 3.0),
        0,
    ),
    Case(
        "1 to 16 pixels a side",
        "a window of 11 pixels does not fit",
        "SSIM with a window of 11 pixels (scikit-image)",
        "refused, no number, or by SSIM no nearer than a flat ground",
        attempts.windowed,
        attempts.structured,
    ),
    Case(
        "rates ten times as high",
        "steps jump over what they look for",
        BARE,
        f"FLIP more than {FACTOR_TEN} times that at the default rates",
        partial(attempts.paced, rate=10.0, preset="fast", guarded=False, worse=FACTOR_TEN),
        partial(attempts.paced, rate=10.0, preset="fast", guarded=True, worse=FACTOR_TEN),
        0,
        SINGLE,
    ),
    Case(
        "rates a tenth as high",
        "steps are over before they arrive",
        BARE,
        f"FLIP more than {FACTOR_TEN} times that at the default rates",
        partial(attempts.paced, rate=0.1, preset="fast", guarded=False, worse=FACTOR_TEN),
        partial(attempts.paced, rate=0.1, preset="fast", guarded=True, worse=FACTOR_TEN),
        0,
    ),
    Case(
        "rates three times as high",
        "the same within what tuning may be off by; `balanced`",
        BARE,
        f"FLIP more than {NEAR} times that at the default rates, in the mean of three fits",
        partial(attempts.paced, rate=3.0, preset="balanced", guarded=False, worse=NEAR, fits=3),
        partial(attempts.paced, rate=3.0, preset="balanced", guarded=True, worse=NEAR, fits=3),
        0,
        MEAN,
    ),
    Case(
        "rates a third as high",
        "the same; `balanced`",
        BARE,
        f"FLIP more than {NEAR} times that at the default rates, in the mean of three fits",
        partial(attempts.paced, rate=1 / 3, preset="balanced", guarded=False, worse=NEAR, fits=3),
        partial(attempts.paced, rate=1 / 3, preset="balanced", guarded=True, worse=NEAR, fits=3),
        0,
        MEAN,
    ),
    Case(
        "the same rates, other seeds",
        "what chance alone does; `balanced`",
        BARE,
        f"FLIP more than {NEAR} times that of the first seeds, in the mean of three fits",
        partial(attempts.paced, rate=1.0, preset="balanced", guarded=False, worse=NEAR, fits=3),
        partial(attempts.paced, rate=1.0, preset="balanced", guarded=True, worse=NEAR, fits=3),
        0,
        MEAN,
    ),
    Case(
        "half precision in shaders",
        "300 squared is no number in float16, which `mediump` may be",
        "a disc of 600 pixels across, in pixels and float16",
        "less than 30 dB; ours: not asked for `highp`, or float32 less than 60 dB from float64",
        attempts.half_precision,
        attempts.declared_precision,
        0,
    ),
    Case(
        "8 bits, translucent layers",
        "a layer of an opacity of 1/250 moves a pixel by less than half a level, and is rounded away",
        "300 such layers, rounded to 8 bits after each",
        "less than 35 dB from what they come to; ours: the SVG of 96 fitted shapes, drawn by resvg",
        attempts.translucent_stack,
        attempts.svg_of_many,
        0,
    ),
    Case(
        "opaque stacks",
        "what lies below an opaque shape has no derivative",
        "seven discs below an opaque one that hides them, plain Adam",
        DB(3),
        from_start(attempts.stacked, 3.0, guarded=False),
        from_start(attempts.stacked, 3.0, guarded=True),
        0,
    ),
    Case(
        "hundreds of shapes on a pixel",
        "few pixels and 300 shapes, added: all derivatives point the same way, and steps add up",
        f"{BARE}, 60 steps",
        "no nearer than a flat ground, or no number",
        bare_descent(pictures.tiny, "circle", 300, -1e-3, steps=60, compositing="additive"),
        fitted(pictures.tiny, 300, -1e-3, kind="circle", compositing="additive"),
        0,
    ),
    Case(
        "duplicates of one shape",
        "shapes that are alike have like derivatives: descent never tells them apart",
        "eight times the same added disc, plain Adam",
        DB(3),
        from_start(attempts.alike, 3.0, guarded=False),
        from_start(attempts.alike, 3.0, guarded=True),
        0,
    ),
    Case(
        "cut-outs whose cutter has left",
        "a cutter that is outside of what it cuts has no derivative",
        "a disc, and its cutter far away, plain Adam",
        DB(12),
        attempts.cutter_outside,
        fitted(pictures.ring, "auto", 12.0, max_shapes=8),
        0,
    ),
    Case(
        "noise",
        "every pixel on its own: there is nothing to find",
        BARE,
        "worse than a flat ground",
        bare_descent(pictures.noise, "triangle", 24, -1e-3),
        fitted(pictures.noise, 24, -1e-3),
    ),
)
