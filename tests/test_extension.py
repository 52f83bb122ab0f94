"""A kind, a paint and a join that only this module knows, in every renderer and every export of a scene."""

import json
import random
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import torch

from sdf2vec import Exported, Layer, Scene, Shape, dumps, loads
from sdf2vec.api import export, exported
from sdf2vec.blend import COMPOSITING, JOINS, Join
from sdf2vec.engines import chromium
from sdf2vec.engines.pages import ELEMENT
from sdf2vec.export import EXPORTERS, Exporter, packing
from sdf2vec.export.options import SVG_PROFILES, Options
from sdf2vec.expr import Expr, absolute, cos, dot, length, maximum, minimum, mix, select, sin, vec2, vec4
from sdf2vec.fit.adam import adam_over
from sdf2vec.fit.constraints import project
from sdf2vec.fit.initialization import Layers, place
from sdf2vec.fit.presets import Start
from sdf2vec.function import function
from sdf2vec.kind import Kind, rotate
from sdf2vec.layer import Part
from sdf2vec.operation import FLOAT, VEC4
from sdf2vec.paints import PAINTS, Paint
from sdf2vec.render import culled, fused, reference, triton_fused
from sdf2vec.render.tensors import from_scene, to_scene
from sdf2vec.roundtrip import ROUND_TRIPS, compare
from sdf2vec.scene import Joint
from sdf2vec.shapes import KINDS
from sdf2vec.units import ANGLE, COLOR, FREQUENCY, LENGTH, POSITION, Parameter
from tests.export.test_component import assert_shows, module
from tests.triton_device import DEVICE

# --- a disc squeezed and waved: nine numbers -----------------------------------------------------------------


def waved(
    p: Expr, center: Expr, radii: Expr, angle: Expr, amplitude: Expr, frequency: Expr, phase: Expr
) -> Expr:
    q = rotate(p - center, vec2(cos(angle), sin(angle)))
    return length(maximum(absolute(q) - radii, 0.0)) - amplitude * (2.0 + sin(dot(q, frequency) + phase))


def waved_extent(margin: Expr, center: Expr, radii: Expr, angle: Expr, amplitude: Expr, *rest: Expr) -> Expr:
    half = vec2(length(radii) + 3.0 * amplitude + margin)
    return vec4(center - half, center + half)


WAVED = Kind(
    "waved",
    (
        Parameter("center", POSITION, (0.0, 0.0)),
        Parameter("radii", LENGTH, (0.6, 0.4), positive=True),
        Parameter("angle", ANGLE),
        Parameter("amplitude", LENGTH, (0.1,)),
        Parameter("wave", FREQUENCY, (2.0, 1.0)),
        Parameter("phase", ANGLE),
    ),
    waved,
    waved_extent,
    area=lambda center, radii, *rest: 4.0 * radii.x * radii.y,
    thickness=lambda center, radii, *rest: 2.0 * minimum(radii.x, radii.y),
    exact=False,
    slope=lambda center, radii, angle, amplitude, wave, phase: 1.0 + amplitude * length(wave),
)

# --- rings of two colours; what is in one of two and not in both ----------------------------------------------

RINGS = Paint(
    "rings",
    lambda q, color, color_ring, pace: mix(color, color_ring, 0.5 + 0.5 * cos(pace * dot(q, q))),
    (Parameter("color_ring", COLOR, (0.0, 0.0, 0.0)), Parameter("pace", FREQUENCY, (5.0,))),
)


@function("exclusion", a=VEC4, b=VEC4, smoothness=FLOAT)
def exclusion(a: Expr, b: Expr, smoothness: Expr) -> Expr:
    nearer = mix(a, b, select(b.w < a.w, 1.0, 0.0))
    return vec4(nearer.x, nearer.y, nearer.z, maximum(minimum(a.w, b.w), -maximum(a.w, b.w)))


EXCLUSION = Join("exclusion", "^", exclusion, adds=True)

STRUCTURES = [
    (Part("waved", "rings"),),
    (Part("circle"), Part("waved", "rings", "exclusion")),
]


@pytest.fixture(autouse=True)
def known(monkeypatch):
    """For the time of a test, the tables hold them."""
    monkeypatch.setitem(KINDS, "waved", WAVED)
    monkeypatch.setitem(PAINTS, "rings", RINGS)
    monkeypatch.setitem(JOINS, "exclusion", EXCLUSION)


def random_shape(part, r, lowest):
    x, y, size = r.uniform(-0.6, 0.6), r.uniform(-0.4, 0.4), r.uniform(0.05, 0.2)
    first, ring = (tuple(r.uniform(lowest, 1) for _ in range(3)) for _ in range(2))
    numbers = {
        "circle": (x, y, size),
        "waved": (x, y, size, size / 2, r.uniform(0, 6), size / 5, r.uniform(-9, 9), 8.0, r.uniform(0, 6)),
    }[part.kind]
    return Shape(
        part.kind, numbers, first, part.paint, (*ring, r.uniform(1, 6)) if part.paint == "rings" else ()
    )


def toy_scene(compositing="over", layers=6, width=60, height=40):
    r, lowest, made = random.Random(2), COMPOSITING[compositing].lowest, []
    for index in range(layers):
        structure = STRUCTURES[index % 2]
        joints = tuple(Joint(part.join, 0.02) for part in structure[1:])
        shapes = tuple(random_shape(part, r, lowest) for part in structure)
        made.append(Layer(shapes, r.choice([0.02, 0.1]), r.choice([1.0, 0.7]), joints))
    return Scene(width, height, tuple(made), (0.3, 0.5, 0.7), compositing)


# --- files and the reference ---------------------------------------------------------------------------------


def test_scene_files_hold_it_by_name():
    scene = toy_scene()
    assert loads(dumps(scene)) == scene == to_scene(from_scene(scene, torch.float64), 60, 40)
    first = json.loads(dumps(scene))["layers"][0]
    assert list(first) == [
        "kind",
        "paint",
        "color",
        "color_ring",
        "pace",
        *(p.name for p in WAVED.parameters),
        "opacity",
        "falloff",
    ]
    assert len(scene.layers[0].shapes[0].parameters) == 9


def test_the_reference_draws_it_as_numpy_does():
    x0, y0, a, b, angle, amplitude, u, v, phase = numbers = (0.1, 0.0, 0.3, 0.2, 0.4, 0.03, 9.0, -5.0, 1.0)
    shape = Shape("waved", numbers, (1, 0, 0.5), "rings", (0, 1, 0.25, 3.0))
    image = reference.render(Scene(40, 40, (Layer((shape,), 0.1),)), dtype=torch.float64).numpy()
    x, y = np.meshgrid(*[(np.arange(40) + 0.5) / 40 - 0.5] * 2)
    along, across = x - x0, y - y0
    c, s = np.cos(angle), np.sin(angle)
    qx, qy = along * c + across * s, across * c - along * s
    outside = np.hypot(np.maximum(abs(qx) - a, 0), np.maximum(abs(qy) - b, 0))
    d = outside - amplitude * (2 + np.sin(u * qx + v * qy + phase))
    cover = np.clip((1 / (1 + np.exp(-10 * (0.05 - d) / 0.1)) - 1 / 512) / (1 - 2 / 512), 0, 1)
    half = np.hypot(a, b) + 3 * amplitude  # of the frame: the box that the kind says
    ring = 0.5 + 0.5 * np.cos(3 * ((x - x0) ** 2 + (y - y0) ** 2) / half**2)
    np.testing.assert_allclose(image[:3], np.stack([1 - ring, ring, 0.5 - 0.25 * ring]) * cover, atol=1e-12)


# --- renderers -----------------------------------------------------------------------------------------------


def outcome(composite, tensors):
    """The image and the derivatives of a fixed random sum of it, float64."""
    leaves = [tensor.requires_grad_() for group in tensors.groups for tensor in group.values.values()]
    image = composite(tensors, 37, 21)
    weights = torch.randn(image.shape, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    grads = torch.autograd.grad((image * weights.to(image)).sum(), leaves)
    return [part.detach().cpu().double() for part in (image, *grads)]


RENDERERS = {
    "culled": (culled.composite, torch.float64, 1e-12),
    "fused": (fused.composite, torch.float32, 1e-3),
    "triton": (triton_fused.composite, torch.float32, 1e-3),
}


@pytest.mark.filterwarnings("ignore::RuntimeWarning:triton")
@pytest.mark.parametrize("name", RENDERERS)
def test_every_renderer_draws_it_and_knows_its_derivatives(name, require_engine):
    if name == "triton":
        require_engine("triton")
    composite, dtype, tolerance = RENDERERS[name]
    scene = toy_scene()
    device = DEVICE if name == "triton" else "cpu"
    want = outcome(reference.composite, from_scene(scene, torch.float64))
    got = outcome(composite, from_scene(scene, dtype, device))
    assert float((got[0] - want[0]).abs().max()) <= 0.1 * tolerance
    for one, other in zip(got[1:], want[1:], strict=True):
        assert float((one - other).abs().max()) <= tolerance * max(1.0, float(other.abs().max()))


def test_a_fit_starts_with_it_and_comes_nearer():
    """Of a picture that is half dark: fifteen steps take a quarter of the error away."""
    target = torch.cat([torch.full((3, 20, 15), 0.2), torch.full((3, 20, 15), 0.8)], dim=2)
    layers = Layers(("waved",), "over", 1, "rings")
    tensors = place(target, (1.5, 1.0), layers, 5, Start(), torch.Generator().manual_seed(0))
    assert tensors.groups[0].structure == ((Part("waved", "rings")),)
    optimizer, losses = adam_over(tensors), []
    for _ in range(15):
        optimizer.zero_grad()
        loss = (reference.composite(tensors, 30, 20)[:3] - target).abs().mean()
        loss.backward()
        optimizer.step()
        project(tensors, 0.05)
        losses.append(float(loss.detach()))
    assert losses[-1] < 0.75 * losses[0]
    assert to_scene(tensors, 30, 20).shape_count == 5


# --- exports -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("compositing", COMPOSITING)
@pytest.mark.parametrize("layout", ["readable", "table", "tiled", "data"])
def test_every_layout_of_a_shader_shows_it(layout, compositing, require_engine):
    require_engine("opengl")
    scene = toy_scene(compositing)
    made = exported(scene, "glsl", layout=layout)
    assert compare(ROUND_TRIPS["glsl"][0], made, scene, (101, 67)).largest_error <= 0.1


@pytest.mark.parametrize("layout", ["readable", "data"])
def test_webgpu_shows_it(layout, require_engine):
    require_engine("webgpu")
    scene = toy_scene()
    made = exported(scene, "wgsl", layout=layout)
    assert compare(ROUND_TRIPS["wgsl"][0], made, scene, (101, 67)).largest_error <= 0.1


def test_it_is_packed_within_the_error(monkeypatch, require_engine):
    require_engine("opengl")
    monkeypatch.setattr(packing, "SAMPLE", 1 << 17)
    scene = toy_scene()
    made = exported(scene, "shadertoy", layout="packed", framing="fit")
    assert 0.0 < made.error <= packing.LIMIT
    result = compare(ROUND_TRIPS["shadertoy"][0], made, scene, (101, 67))
    assert result.largest_error <= packing.LIMIT + 0.05


@pytest.mark.parametrize("profile", SVG_PROFILES)
def test_svg_shows_it(profile, require_engine):
    """Edges and joins are traced. Rings are no linear gradient, which is all that comes near to a strange paint."""
    require_engine("resvg")
    scene = toy_scene(width=150, height=100)
    plain = replace(scene, layers=tuple(map(in_one_color, scene.layers)))
    (trip,) = (t for t in ROUND_TRIPS["svg"] if (t.engine, t.profile) == ("resvg", profile))
    for drawn, least in ((scene, 27), (plain, 36)):
        result = compare(trip, exported(drawn, "svg", svg_profile=profile), drawn, (150, 100))
        assert result.psnr >= least
        assert abs(result.mean_error) <= 0.3


def in_one_color(layer):
    """The layer with rings that are not seen."""
    color = layer.shapes[0].color
    shapes = tuple(
        replace(shape, color=color, paint_parameters=(*color, 1.0) if shape.paint_parameters else ())
        for shape in layer.shapes
    )
    return replace(layer, shapes=shapes)


def test_a_page_shows_it(require_engine):
    require_engine("page")
    scene = toy_scene(width=90, height=60)
    made = exported(scene, "html", alone=True)
    assert compare(ROUND_TRIPS["html"][0], made, scene, (300, 200)).largest_error <= 1.1


def test_the_web_component_shows_it(require_engine):
    require_engine("chromium")
    scene = toy_scene(width=90, height=60)
    files = {"index.html": ELEMENT, "sdf-image.js": module(), "picture.scene.json": dumps(scene)}
    with chromium.opened(files, 300, 200) as page:
        assert_shows(page, scene, 300, 200)


def test_pictures_and_files_are_exported():
    scene = toy_scene()
    assert loads(export(scene, "json")) == scene
    png = export(scene, "png")
    assert isinstance(png, bytes)
    assert png.startswith(b"\x89PNG")


def test_a_target_of_its_own(monkeypatch):
    """An exporter that only this module knows is found by name, and given the scene with what it alone knows."""

    def count(scene: Scene, options: Options) -> Exported:
        kinds = Counter(part.kind for layer in scene.layers for part in layer.structure)
        return Exported(f"{options.title}: {kinds['waved']} waved", notes=("counted",))

    monkeypatch.setitem(EXPORTERS, "count", Exporter(".count.txt", count, "how many"))
    made = exported(toy_scene(layers=5), "count", title="a toy")
    assert (made.raw, made.notes) == (b"a toy: 5 waved", ("counted",))
