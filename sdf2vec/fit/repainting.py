"""Gradients put into the shapes that were found in a picture without them: what `shading` took out of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import torch

from ..arrays import Float64Array, IntArray
from ..graph import components_of
from ..layer import P
from ..lower.numpy import Arrays, compile_numpy
from ..render.occlusion import showing
from ..render.reference import canvas, layers_at
from ..render.tensors import SceneTensors, from_scene
from ..scene import Layer, Scene, Shape
from ..shapes import KINDS
from ..units import NEAREST_STOP
from .bends import BentShade
from .color_stops import ColorStops
from .ramps import KIND, MARGIN, PAINT
from .rings import RadialShade
from .shades import Gradient
from .shading import Shading

LOOKED = 128  # pixels squared, at which is told which regions are seen of a layer
NEAR = 0.1  # how far a channel of its colour may be from that of the region
OPAQUE = 0.9  # at least
UNSEEN = 3.0 / 255  # change of a colour from a shape's middle to its edge that is not worth a gradient
LEAST = 0.05  # share of the way from a shape's middle to its edge on which there are such colours, if there are some
OVER = 1.0 / 255  # beyond what a channel may be, by which it may seem to be there
LINEAR_PAINTS, RADIAL_PAINTS = (PAINT, "linear3"), ("radial", "radial3")  # of two colours, of three
GRID = np.stack(np.meshgrid((-1.0, 0.0, 1.0), (-1.0, 0.0, 1.0)), axis=-1).reshape(-1, 2)  # of a shape's frame


def repainted(scene: Scene, shading: Shading, ground: Gradient | None) -> Scene:
    """A scene that is near to a picture without its gradients, with these: in layers of which the region of one is
    seen, and in a box under all that shows the ground's, where it has one.
    """
    tensors = from_scene(scene)
    layers = [
        _painted(layer, _shade_of(layer, seen, shading), tensors.size)
        for layer, seen in zip(scene.layers, _seen(scene, tensors, shading), strict=True)
    ]
    below = [] if ground is None else [Layer((_graded(_over_all(tensors.size), ground, tensors.size),))]
    return replace(scene, layers=(*below, *layers))


def ground_shade(ground: torch.Tensor, shading: Shading) -> Gradient | None:
    """The gradient that a ground [4] of the picture without any is in place of, if it is one."""
    near = (number for number in shading.graded if _is_near(shading, number, ground[:3].tolist()))
    return next((shading.shades[number - 1] for number in near), None)


def _seen(scene: Scene, tensors: SceneTensors, shading: Shading) -> Float64Array:
    """How much is seen of each layer in each region, [L, R], in draw order."""
    labels = _smaller(shading.nearest)
    height, width = labels.shape
    within = np.eye(len(shading.shades) + 1)[labels.ravel()][:, 1:]
    if not scene.layers:
        return np.zeros((0, within.shape[1]))
    covers, _ = layers_at(tensors, *canvas(tensors, width, height))
    alphas = covers.numpy() * np.array([[layer.opacity] for layer in scene.layers], np.float32)
    found: Float64Array = (alphas * showing(alphas)) @ within
    return found


def _smaller(labels: IntArray) -> IntArray:
    """Labels [H, W] of a part of the pixels: of about so many as are looked at."""
    step = max(1, round(math.sqrt(labels.size) / LOOKED))
    return labels[step // 2 :: step, step // 2 :: step]


def _shade_of(layer: Layer, seen: Float64Array, shading: Shading) -> Gradient | None:
    """The gradient of the region [R] in which most is seen of a layer, if that is one and it has its colour."""
    number = int(seen.argmax()) + 1
    if number not in shading.graded or layer.opacity < OPAQUE:
        return None
    return shading.shades[number - 1] if _is_near(shading, number, layer.shapes[0].color) else None


def _is_near(shading: Shading, number: int, color: Sequence[float]) -> bool:
    """Whether a colour is that of a region without its gradient."""
    return bool(np.abs(shading.flats[number - 1, :3] - color).max() < NEAR)


def _painted(layer: Layer, shade: Gradient | None, size: tuple[float, float]) -> Layer:
    """A layer whose first shape has a gradient; as it is without one."""
    if shade is None:
        return layer
    return replace(layer, shapes=(_graded(layer.shapes[0], shade, size), *layer.shapes[1:]))


def _over_all(size: tuple[float, float]) -> Shape:
    """A box that covers the canvas, which has this size in scene units."""
    half = tuple(side / 2 + MARGIN for side in size)
    return Shape.of(KIND, center=(0.0, 0.0), half_size=half, angle=0.0, corner_radius=0.0)


def _graded(shape: Shape, shade: Gradient, size: tuple[float, float]) -> Shape:
    """A shape that shows a gradient on a canvas of this size, as far as there are such colours."""
    middle, right, down = (
        np.array(_frame(shape.kind)(*shape.parameters, *point)) for point in ((0, 0), (1, 0), (0, 1))
    )
    back = np.linalg.inv(np.stack([right - middle, down - middle], axis=1))  # from the frame to the scene
    if isinstance(shade, RadialShade):
        return _ringed(shape, shade, middle, back)
    if isinstance(shade, BentShade):
        return _bent(shape, shade, middle, back, size)
    place = (shade.place - 0.5) * size
    slopes = shade.slopes[:, :3] / np.array(size)[:, None]
    axes, strengths, changes = np.linalg.svd(back.T @ slopes, full_matrices=False)
    axis, change = axes[:, 0], strengths[0] * changes[0]
    color = shade.color[:3] + (back @ -middle - place) @ slopes
    extent = float(np.abs(axis).sum())
    changes = extent * np.abs(change) > UNSEEN
    if not changes.any():
        return replace(shape, color=tuple(color.clip(0.0, 1.0).tolist()))
    low, high = _colorful(color[changes], change[changes], extent)
    ends = ((color + end * change).clip(0.0, 1.0) for end in (low, high))
    first, last, direction = (tuple(values.tolist()) for values in (*ends, axis / (high - low)))
    shift = -low / (high - low) - 0.5
    return Shape.of(
        shape.kind, first, PAINT, **shape.named(), color_end=last, direction=direction, shift=shift
    )


def _colorful(color: Float64Array, change: Float64Array, extent: float) -> tuple[float, float]:
    """From where on and up to where a line of colours, which has one [C] at 0 and goes as far as an extent both ways,
    has none that there is not.
    """
    ends = np.sort((np.array([[-OVER], [1.0 + OVER]]) - color) / change, axis=0)
    low, high = max(float(ends[0].max()), -extent), min(float(ends[1].min()), extent)
    return (low, high) if high - low > LEAST * extent else (-extent, extent)


def _ringed(shape: Shape, rings: RadialShade, middle: Float64Array, back: Float64Array) -> Shape:
    """A shape that shows rings. Its frame's origin is `middle` away from the canvas' in the frame; `back` [2, 2] leads
    from there to the scene.

    Ellipses along other axes than the frame's are as steep along these.
    """
    near, far = rings.stops.values[[0, -1]]
    stretched = np.diag([1.0, rings.squeeze]) @ back
    focus = middle + np.linalg.solve(back, (rings.place - 0.5) * rings.sides)
    steepness = np.linalg.norm(stretched, axis=0) / (far - near)
    shares = np.linalg.norm((GRID - focus) * steepness, axis=1) - near / (far - near)
    own = {"focus": focus, "steepness": steepness, "shift": -near / (far - near)}
    return _told(shape, rings.stops, shares, own, RADIAL_PAINTS)


def _bent(
    shape: Shape, shade: BentShade, middle: Float64Array, back: Float64Array, size: tuple[float, float]
) -> Shape:
    """A shape that shows a gradient of several colours; `middle` and `back` as for rings."""
    near, far = shade.stops.values[[0, -1]]
    slope = shade.direction / size
    direction = back.T @ slope / (far - near)
    start = (shade.direction.sum() / 2 - back @ middle @ slope - near) / (far - near)
    return _told(
        shape,
        shade.stops,
        start + GRID @ direction,
        {"direction": direction, "shift": start - 0.5},
        LINEAR_PAINTS,
    )


def _told(
    shape: Shape,
    stops: ColorStops,
    shares: Float64Array,
    own: dict[str, Float64Array | float],
    paints: tuple[str, str],
) -> Shape:
    """A shape in the paint of as many colours as stops, which are where the paint's numbers `own` say; in one,
    if it shows hardly more: `shares` of the way from the first stop to the last [P].
    """
    near, far = stops.values[[0, -1]]
    shown = stops.at(near + shares * (far - near)).clip(0.0, 1.0)
    middle = shown[len(GRID) // 2, :3]
    if np.abs(shown[:, :3] - middle).max() <= UNSEEN:
        return replace(shape, color=tuple(middle.tolist()))
    first, *between, last = (tuple(color[:3].tolist()) for color in stops.colors.clip(0.0, 1.0))
    numbers = {name: np.asarray(value).tolist() for name, value in own.items()}
    if between:
        stop = (stops.values[1] - near) / (far - near)
        numbers |= {
            "color_middle": between[0],
            "stop": float(np.clip(stop, NEAREST_STOP, 1.0 - NEAREST_STOP)),
        }
    return Shape.of(shape.kind, first, paints[len(between)], **shape.named(), color_end=last, **numbers)


@cache
def _frame(kind: str) -> Callable[..., Arrays]:
    """A point in the frame in which a shape is painted, from the shape's numbers and the point."""
    own = KINDS[kind]
    return compile_numpy([own.frame(*own.variables()).at(P)], [*own.scalars(), *components_of(P)])
