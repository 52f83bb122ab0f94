"""As many shapes as a size limit holds, measured by a made-up size: so much for each shape."""

import numpy as np
import pytest

from sdf2vec import Sdf2vecError, fitted, share_of
from sdf2vec.export import packing
from sdf2vec.fit import auto
from sdf2vec.fit.drawings import Drawn, is_photograph
from sdf2vec.image import load
from tests.fit.drawn import noise
from tests.scenes import random_scene

pytestmark = pytest.mark.usefixtures("few_steps")


def by_count(most, ground=0.0):
    """All of the limit at so many shapes."""
    return lambda scene: ground + (1.0 - ground) * scene.shape_count / most


def test_as_many_shapes_as_there_is_room_for():
    most = 24
    found = fitted(
        noise(), preset="fast", kind="triangle", max_falloff=0.0, min_area=1e-4, share=by_count(most, 0.25)
    )
    assert found.scene.shape_count == most
    assert found.met
    assert "100% of the size limit" in found.reason


def test_the_largest_number_of_shapes_holds_too():
    found = fitted(
        noise(),
        preset="fast",
        kind="circle",
        max_falloff=0.0,
        min_area=1e-4,
        max_shapes=6,
        share=by_count(50),
    )
    assert found.scene.shape_count == 6
    assert found.met


def test_what_matters_least_is_left_out():
    """Later shapes are larger here, so that the guess is too high."""
    found = fitted(
        noise(),
        preset="fast",
        kind="circle",
        max_falloff=0.0,
        min_area=1e-4,
        share=lambda scene: max(scene.shape_count, scene.shape_count * 2 - 16) / 20,
    )
    assert 15 <= found.scene.shape_count <= 18
    assert found.met


def test_a_limit_below_the_ground_is_said():
    found = fitted(noise(), preset="fast", min_area=1e-4, share=lambda scene: 2.0)
    assert not found.met
    assert found.scene.shape_count == 0


def test_a_number_that_was_told_stays():
    assert fitted(noise(), 6, preset="fast", share=by_count(2)).scene.shape_count == 6


def test_the_share_is_that_of_the_largest_export(monkeypatch):
    monkeypatch.setattr(packing, "SAMPLE", 1 << 17)  # how many bits each number wants is not asked here
    scene = random_scene(("circle", "box"), layers=5, joins=())
    svg, text = (share_of([target], max_bytes=4000)(scene) for target in ("svg", "shadertoy"))
    assert share_of(["svg", "shadertoy"], max_bytes=4000)(scene) == max(svg, text)
    assert share_of(["svg"], max_bytes=2000)(scene) == 2 * svg
    with pytest.raises(Sdf2vecError, match="unknown target"):
        share_of(["eps"], max_bytes=4000)


def test_in_a_photograph_no_drawing_is_looked_for(monkeypatch):
    """Smooth everywhere, as photographs are, and many colours."""
    x, y = np.meshgrid(np.linspace(0, 1, 640), np.linspace(0, 1, 640))
    hills = [np.sin(12 * x + 3 * y + c) * np.cos(11 * y - 4 * x * y) for c in range(3)]
    picture = load(0.5 + 0.25 * np.stack(hills, axis=2).astype(np.float32))
    assert Drawn.of(picture).flat
    assert is_photograph(Drawn.of(picture))
    drawing = load(
        np.pad(np.full((60, 80, 3), 0.3, np.float32), ((99, 99), (99, 99), (0, 0)), constant_values=0.8)
    )
    assert not is_photograph(Drawn.of(drawing))
    monkeypatch.setattr(auto, "Drawing", lambda *given: pytest.fail("looked for a drawing"))
    fitted(picture, preset="fast", kind="circle", max_falloff=0.0, share=by_count(5))
    assert fitted(picture, preset="fast", kind="circle", max_shapes=5).scene.shape_count == 5


@pytest.mark.parametrize("is_wanted", [True, False])
def test_a_share_may_say_how_near_what_is_written_comes(is_wanted):
    """Which of soft and sharp shapes are taken, whatever their renders are."""

    class Share:
        def __call__(self, scene):
            return scene.shape_count / 6

        def near(self, scene, picture):
            return 20.0 if any(layer.falloff for layer in scene.layers) == is_wanted else 10.0

    found = fitted(noise(), preset="fast", kind="triangle", share=Share())
    assert any(layer.falloff for layer in found.scene.layers) == is_wanted
