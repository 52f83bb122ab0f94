"""What the catalogue tries, each from a seed: a textbook's way, and ours, on the same picture or numbers."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import torch
from skimage.metrics import structural_similarity

from .. import api
from ..arrays import Float32Array
from ..blend import JOINS
from ..engines import resvg
from ..errors import Sdf2vecWarning
from ..expr import var
from ..fit.constraints import thicknesses_of
from ..fit.losses import LOSSES
from ..fit.presets import PRESETS
from ..fit.views import planes
from ..flip import flip
from ..graph import components_of
from ..lower.torch import compile_torch
from ..metrics import psnr, ssim
from ..operation import VEC2, VEC4
from ..render import reference
from ..render.tensors import from_scene
from ..scene import Joint, Layer, Scene, Shape
from ..shapes import KINDS
from . import hard_pictures as pictures
from . import textbook
from .textbook import Discs, anywhere, unguarded

WRONG = math.nan
FAINT = 0.004  # an opacity
OTHER_SEEDS = 1000  # between the seeds of fits to one picture


class Outcome(NamedTuple):
    """Whether a method failed, and its FLIP where there is a picture."""

    failed: bool
    flip: float = WRONG


Attempt = Callable[[int], Outcome]  # of a seed


# --- judges -------------------------------------------------------------------------------------------------


def gains(image: torch.Tensor, target: torch.Tensor, least: float) -> Outcome:
    """Failed unless an image is so many dB nearer to its target than the best flat ground, and holds no NaN."""
    if not bool(image.isfinite().all()):
        return Outcome(True)
    bare = target.mean(dim=(1, 2), keepdim=True).expand_as(target)
    gained = float(psnr(image, target)) - float(psnr(bare, target))
    return Outcome(not gained >= least, float(flip(image, target)))


def is_no_number(tensors: list[torch.Tensor]) -> Outcome:
    """Failed where anything is not finite."""
    return Outcome(not all(bool(tensor.isfinite().all()) for tensor in tensors))


def scene_of(pixels: Float32Array, shapes: int | str, seed: int, **options: Any) -> Scene:
    """Our fit; what it warns of is not said."""
    given = {"preset": "fast", "seed": seed, **options}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Sdf2vecWarning)
        return api.fit(pixels, shapes, **given)  # type: ignore[arg-type] # "auto", where it can


def fitted(make: Callable[[int], Float32Array], shapes: int | str, least: float, **options: Any) -> Attempt:
    """Ours: a fit gains so many dB."""

    def attempt(seed: int) -> Outcome:
        pixels = make(seed)
        scene = scene_of(pixels, shapes, seed, **options)
        return gains(shown(scene), planes(pixels), least)

    return attempt


def shown(scene: Scene) -> torch.Tensor:
    """The render, [3, H, W]."""
    return reference.render(scene)[:3]


def bare_descent(
    make: Callable[[int], Float32Array],
    kind: str,
    shapes: int,
    least: float,
    steps: int = textbook.STEPS,
    **options: Any,
) -> Attempt:
    """Theirs: shapes anywhere, descended with nothing that guards them, gain so many dB."""

    def attempt(seed: int) -> Outcome:
        target = planes(make(seed))
        scene = anywhere(target, kind, shapes, seed, **options)
        return gains(unguarded(scene, target, steps), target, least)

    return attempt


# --- descents that stall ------------------------------------------------------------------------------------


def far_away(seed: int, edge: str) -> Outcome:
    """Small discs on the left, the figure on the right."""
    r = np.random.default_rng(seed)
    rows = [[*r.uniform((-0.4, -0.4), (-0.1, 0.4)), 0.05, 0.9, 0.8, 0.3] for _ in range(3)]
    target = planes(pictures.one_disc(seed))
    return gains(Discs(edge).descend(torch.tensor(rows), target), target, 3.0)


def saturated(seed: int, clamped: bool) -> Outcome:
    """Added discs so bright that a clamped picture is white."""
    r = np.random.default_rng(seed)
    rows = [[*r.uniform(-0.4, 0.4, 2), 0.9, *r.uniform(1.2, 2.0, 3)] for _ in range(6)]
    target = planes(pictures.dark_discs(seed))
    return gains(
        Discs(clamped=clamped, added=True).descend(torch.tensor(rows, dtype=torch.float32), target),
        target,
        1.0,
    )


def stacked(seed: int) -> Scene:
    """Seven discs below one that is opaque and hides them."""
    r = np.random.default_rng(seed)
    below = [
        Layer(
            (Shape.of("circle", tuple(r.random(3)), center=tuple(r.uniform(-0.3, 0.3, 2)), radius=0.1),), 0.05
        )
        for _ in range(7)
    ]
    lid = Layer((Shape.of("circle", (0.5, 0.5, 0.5), center=(0.0, 0.0), radius=1.2),), 0.05)
    return Scene(pictures.SIDE, pictures.SIDE, (*below, lid), (0.5, 0.5, 0.5))


def alike(seed: int) -> Scene:
    """Eight times the same disc: descent moves all of them alike."""
    r = np.random.default_rng(seed)
    same = Shape.of(
        "circle", tuple(r.uniform(-0.05, 0.05, 3)), center=tuple(r.uniform(-0.2, 0.2, 2)), radius=0.25
    )
    ground = tuple(pictures.discs(seed).mean(axis=(0, 1)).tolist())
    return Scene(pictures.SIDE, pictures.SIDE, (Layer((same,), 0.1, 0.9),) * 8, ground, "additive")


def from_start(start: Callable[[int], Scene], least: float, guarded: bool) -> Attempt:
    """A fit of discs that goes on from a bad scene, by ours or with nothing that guards it."""

    def attempt(seed: int) -> Outcome:
        pixels, begin = pictures.discs(seed), start(seed)
        target = planes(pixels)
        if not guarded:
            return gains(unguarded(from_scene(begin), target, frozen="opacity"), target, least)
        scene = scene_of(pixels, 8, seed, start=begin, kind="circle", preset="balanced")
        return gains(shown(scene), target, least)

    return attempt


def cutter_outside(seed: int) -> Outcome:
    """A disc that is cut by one which lies far outside: no derivative calls it back."""
    target = planes(pictures.ring(seed))
    body = Shape.of("circle", (0.2, 0.3, 0.7), center=(0.0, 0.0), radius=0.29)
    cutter = Shape.of("circle", (0.0, 0.0, 0.0), center=(0.75, 0.75), radius=0.1)
    layer = Layer((body, cutter), 0.02, 1.0, joints=(Joint("subtraction", 0.0),))
    scene = Scene(96, 96, (layer,), (0.95, 0.95, 0.9))
    return gains(unguarded(from_scene(scene), target), target, 12.0)


# --- numbers that break -------------------------------------------------------------------------------------


def joined(seed: int, join: Callable[..., torch.Tensor]) -> Outcome:
    """Distances hundreds of times the smoothness, and their derivatives."""
    r = np.random.default_rng(seed)
    a, b = (torch.tensor(r.uniform(0.5, 2.0) * r.choice([-1, 1]), dtype=torch.float32) for _ in "ab")
    k = torch.tensor(10 ** r.uniform(-6, -2.5), dtype=torch.float32)
    inputs = [value.requires_grad_() for value in (a, b, k)]
    found = join(*inputs)
    slopes = torch.autograd.grad(found, inputs, allow_unused=True, materialize_grads=True)
    outcome = is_no_number([found, *slopes])
    return Outcome(outcome.failed or abs(float(found.detach() - torch.minimum(a, b).detach())) > 0.01)


def our_union(a: torch.Tensor, b: torch.Tensor, k: torch.Tensor) -> torch.Tensor:
    """The distance of two shapes' smooth union."""
    first, second, smoothness = var("a", VEC4), var("b", VEC4), var("k")
    union = compile_torch(
        [JOINS["union"].formula(first, second, smoothness).w],
        [*components_of(first), *components_of(second), smoothness],
    )
    zero = torch.zeros(())
    return union(zero, zero, zero, a, zero, zero, zero, b, k)[0]


def textbook_singular(seed: int) -> Outcome:
    """The derivative at a disc's centre, and of a segment whose ends are one point."""
    r = np.random.default_rng(seed)
    x, y, radius = (torch.tensor(value, requires_grad=True) for value in (0.0, 0.0, float(r.random())))
    if seed % 2:
        textbook.disc_distance(x, y, radius).backward()
        return is_no_number([value.grad for value in (x, y) if value.grad is not None])
    a = torch.tensor(r.random(2), requires_grad=True)
    b = a.detach().clone().requires_grad_()
    textbook.segment_distance(torch.zeros(2, dtype=torch.float64), a, b).backward()
    return is_no_number([value.grad for value in (a, b) if value.grad is not None])


def our_singular(seed: int) -> Outcome:
    """Every kind at a point it is centred on, with sizes of 0 and corners in one point, and every derivative."""
    kind = list(KINDS.values())[seed % len(KINDS)]
    at = float(np.random.default_rng(seed).choice([0.0, 0.25]))
    inputs = [torch.tensor([at, 0.0], requires_grad=True) for _ in "xy"]
    values = [torch.full((2,), at if name.unit.name == "position" else 0.0) for name in _scalars(kind)]
    free = [value.requires_grad_() for value in values]
    p = var("p", VEC2)
    fields = [kind.distance(p, *kind.variables())]
    found = compile_torch(fields, [*components_of(p), *kind.scalars()])(*inputs, *free)
    slopes = torch.autograd.grad(torch.stack(list(found)).sum(), [*inputs, *free], allow_unused=True)
    return is_no_number([*found, *(slope for slope in slopes if slope is not None)])


def _scalars(kind: Any) -> list[Any]:
    """The parameter of each of a kind's numbers."""
    return [parameter for parameter in kind.parameters for _ in range(parameter.width)]


def flip_slopes(seed: int, smooth: bool) -> Outcome:
    """FLIP's derivative where a picture is out of range or equal to its target: no number, or none at all."""
    target = torch.rand(3, 16, 16, generator=torch.Generator().manual_seed(seed))
    image = {0: target.clone(), 1: target + 1.5, 2: target - 1.5}[seed % 3].requires_grad_()
    loss = LOSSES["flip"](target)(image) if smooth else flip(image.clamp(0.0, 1.0), target)
    loss.backward()
    assert image.grad is not None
    is_wrong = seed % 3 != 0  # what is equal may stay
    stuck = is_wrong and float((image.grad != 0).float().mean()) < 0.5
    return Outcome(is_no_number([image.grad]).failed or stuck)


# --- shapes that degenerate ---------------------------------------------------------------------------------


def thin(kind: str, guarded: bool) -> Attempt:
    """Whether any shape is thinner than a pixel after a fit to noise."""

    def attempt(seed: int) -> Outcome:
        pixels = pictures.noise(seed)
        target = planes(pixels)
        if guarded:
            scene = from_scene(scene_of(pixels, 24, seed, kind=kind))
        else:
            scene = anywhere(target, kind, 24, seed)
            unguarded(scene, target)
        thinnest = min(float(width.detach().min()) for width in thicknesses_of(scene))
        with torch.no_grad():
            image = reference.displayed(reference.composite(scene, pictures.SIDE, pictures.SIDE))[:3]
        return Outcome(not thinnest >= 0.999 / pictures.SIDE, float(flip(image, target)))

    return attempt


# --- pictures that are too small for a window ---------------------------------------------------------------


def windowed(seed: int) -> Outcome:
    """SSIM with a window of 11 pixels, wherever it fits."""
    pixels = pictures.tiny(seed)
    try:
        structural_similarity(pixels, pixels, win_size=11, channel_axis=2, data_range=1.0)
    except ValueError:
        return Outcome(True)
    return Outcome(False)


def structured(seed: int) -> Outcome:
    """Ours by SSIM, and judged by it."""
    pixels = pictures.tiny(seed)
    image, target = shown(scene_of(pixels, 5, seed, loss="ssim", kind="circle")), planes(pixels)
    bare = target.mean(dim=(1, 2), keepdim=True).expand_as(target)
    return Outcome(not ssim(image, target) > ssim(bare, target), float(flip(image, target)))


# --- rates --------------------------------------------------------------------------------------------------


def paced(seed: int, rate: float, preset: str, guarded: bool, worse: float, fits: int = 1) -> Outcome:
    """FLIP at another rate than the default, no more than so many times that at the default one; in the mean of so
    many fits to a picture. At the default rates, those of other seeds.
    """
    pixels = pictures.scene_like(seed)
    target = planes(pixels)
    others = fits if rate == 1.0 else 0
    usual, found = (
        sum(
            _flip_at(pixels, target, seed + OTHER_SEEDS * number, factor, preset if guarded else None)
            for number in range(first, first + fits)
        )
        / fits
        for factor, first in ((1.0, 0), (rate, others))
    )
    return Outcome(not found <= worse * usual, found)


def _flip_at(
    pixels: Float32Array, target: torch.Tensor, seed: int, factor: float, preset: str | None
) -> float:
    """Of 24 triangles at so many times the default rates; without preset, descended with nothing that guards them."""
    if preset:
        PRESETS["paced"] = PRESETS[preset].paced(rate=factor)
        image = shown(scene_of(pixels, 24, seed, preset="paced"))
    else:
        image = unguarded(anywhere(target, "triangle", 24, seed), target, rate=0.01 * factor)
    return float(flip(image, target)) if bool(image.isfinite().all()) else math.inf


# --- exports ------------------------------------------------------------------------------------------------


def half_precision(seed: int) -> Outcome:
    """A disc of 600 pixels across in half precision, in pixels."""
    r = np.random.default_rng(seed)
    x, y = r.uniform(0.4, 0.6, 2)
    drawn = textbook.half_cover(x, y, 0.3, 1000)
    at = (torch.arange(1000) + 0.5) / 1000
    true = (0.5 - 1000 * (torch.hypot(at[None] - x, at[:, None] - y) - 0.3)).clamp(0, 1)
    return Outcome(not float(psnr(drawn[None], true[None])) >= 30.0)


def declared_precision(seed: int) -> Outcome:
    """Ours asks for high precision wherever a language lets it, and in float32 it is as in float64."""
    scene = scene_of(pictures.discs(seed), 5, seed, kind="circle")
    texts = [str(api.export(scene, "glsl")), str(api.export(scene, "glsl", glsl="es100"))]
    asks = all("precision highp float" in text and "mediump" not in text for text in texts)
    single, double = (reference.render(scene, 600, 600, dtype) for dtype in (torch.float32, torch.float64))
    return Outcome(not (asks and float(psnr(single.double(), double)) >= 60.0))


def translucent_stack(seed: int) -> Outcome:
    """300 layers of an opacity of 1/250, rounded to 8 bits after each, against what they come to."""
    generator = torch.Generator().manual_seed(seed)
    covers = torch.rand(300, 24, 24, generator=generator)
    colors, exact = torch.rand(300, generator=generator), torch.zeros(24, 24)
    for cover, color in zip(covers, colors, strict=True):
        exact = exact + (color - exact) * cover * FAINT
    drawn = textbook.eight_bits_at_a_time(covers, colors, FAINT)
    return Outcome(not float(psnr(drawn[None], exact[None])) >= 35.0)


def svg_of_many(seed: int) -> Outcome:
    """The SVG of 96 fitted shapes, drawn by resvg with 8 bits, against its own render."""
    pixels = pictures.scene_like(seed)
    scene = scene_of(pixels, 96, seed)
    drawn = resvg.render(str(api.export(scene, "svg")), scene.width, scene.height)
    image, own = planes(drawn[..., :3]), shown(scene)
    return Outcome(not float(psnr(image, own)) >= 35.0, float(flip(image, own)))
