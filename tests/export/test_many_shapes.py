"""Targets that cannot serve very many shapes say so before any work; packing looks at a bounded number at a time."""

import numpy as np
import pytest

import sdf2vec
from sdf2vec import Layer, Scene, Sdf2vecError, Shape
from sdf2vec.export import EXPORTERS, packing
from sdf2vec.export.options import Options
from sdf2vec.limits import TEXT_SHAPES
from tests.cli.command import assert_refused
from tests.cli.conftest import folder, run  # noqa: F401 (fixtures)
from tests.scenes import random_scene

MANY = TEXT_SHAPES + 1
DISC = Layer((Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.1),))


@pytest.mark.parametrize(
    ("target", "options"), [("shadertoy", {}), ("godot", {}), ("glsl", {"glsl": "es100"})]
)
def test_targets_whose_text_cannot_hold_so_many_shapes(target, options):
    with pytest.raises(Sdf2vecError, match="4097 shapes are more than its text can hold") as caught:
        sdf2vec.export(Scene(60, 40, (DISC,) * MANY), target, **options)
    assert len(str(caught.value).splitlines()) == 1


def test_targets_with_data_serve_all():
    for target in ("glsl", "wgsl", "three", "svg", "html", "json"):
        EXPORTERS[target].check_count(65536, Options())


def test_it_is_said_before_the_fit(folder, run):  # noqa: F811
    outcome = run("photo.jpg", "--shapes", 5000, "--emit", "json,shadertoy", "-o", "out")
    assert_refused(outcome, "shadertoy.glsl: 5000 shapes are more than its text can hold")
    assert not (folder / "out").exists()


def test_a_page_of_many_shapes_leaves_out_what_cannot_hold_them():
    page = sdf2vec.export(Scene(60, 40, (DISC,) * MANY), "html")
    assert "Shadertoy" not in page
    assert "<canvas" in page


def test_who_is_to_blame_does_not_depend_on_how_many_pixels_are_looked_at_at_a_time(monkeypatch):
    scene = random_scene(("circle", "box"), layers=12, joins=())
    packer, view = packing.Packer(scene, 0.0), packing._View(scene)
    counts, pixels = np.full(12, 6), np.arange(0, len(view.x), max(1, len(view.x) // 500))
    whole = packer.to_blame(view, pixels, counts)
    monkeypatch.setattr(packing, "BLAMED", 100)
    assert len(whole) > 1
    assert packer.to_blame(view, pixels, counts).tolist() == whole.tolist()
