"""An additive scene under `over`, for formats that can't add light: its shapes, fitted again to its render."""

from __future__ import annotations

from dataclasses import replace

from ..image import Picture, fitted_size
from ..quality import psnr_of
from ..render.draw import draw, pixels_of
from ..render.reference import canvas, layers_at
from ..render.tensors import from_scene
from ..scene import Layer, Scene, Shape
from .loop import fit_picture
from .settings import settings_of

LARGEST = 512  # shortest side, in pixels, of the render that is fitted
SIDE = 96  # shortest side on which the first colours are looked at
OPACITY = 0.9


def over_of(scene: Scene) -> tuple[Scene, float]:
    """A scene under `over` with as many shapes that looks like an additive one, and how near it is in dB."""
    if not scene.layers:
        return replace(scene, compositing="over"), float("inf")
    picture = picture_of(scene)
    kinds = list(dict.fromkeys(layer.shapes[0].kind for layer in scene.layers))
    fitted = fit_picture(picture, settings_of(kind=kinds, start=_painted(scene), device="cpu"))
    found = replace(fitted, width=scene.width, height=scene.height)
    return found, psnr_of(found, picture)


def picture_of(scene: Scene) -> Picture:
    """A scene's render as a picture, of no more than `LARGEST` pixels along its shortest side."""
    size = fitted_size(scene.width, scene.height, min(LARGEST, scene.width, scene.height))
    return Picture(pixels_of(scene, *size))


def _painted(scene: Scene) -> Scene:
    """The shapes laid on each other, large ones first, each in the mean colour of the picture where it is."""
    width, height = fitted_size(scene.width, scene.height, min(SIDE, scene.width, scene.height))
    tensors = from_scene(scene)
    image = draw(scene, width, height).flatten(1)
    x, y, pixel = canvas(tensors, width, height)
    covers = layers_at(tensors, x, y, pixel)[0].clamp_min(0.0)
    light = covers @ image[:3].T / (covers @ image[3])[:, None].clamp_min(1e-6)
    colors = light.clamp(0.0, 1.0).tolist()
    order = (-covers.sum(1)).argsort(stable=True).tolist()
    layers = tuple(_laid(scene.layers[i], colors[i]) for i in order)
    return Scene(scene.width, scene.height, layers, scene.background)


def _laid(layer: Layer, color: list[float]) -> Layer:
    red, green, blue = color
    shapes = tuple(Shape(shape.kind, shape.parameters, (red, green, blue)) for shape in layer.shapes)
    return Layer(shapes, layer.falloff, OPACITY, layer.joints)
