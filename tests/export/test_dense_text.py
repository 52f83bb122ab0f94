"""Shader text in few bytes: shorter, and the same picture in an engine."""

import pytest

import sdf2vec
from sdf2vec.export.dense_text import dense
from sdf2vec.roundtrip import ROUND_TRIPS, compare
from tests.scenes import random_scene


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("float a = 0.50; // half", "float a=.5;"),
        ("/* two\nlines */ x = 1.0 - -y;", "x=1.- -y;"),
        ("for (int i = 0; i < 10; i++) c += d.x;", "for(int i=0;i<10;i++)c+=d.x;"),
        ("a = 1e-20;\n#define N 3\nb = N;", "a=1e-20;\n#define N 3\nb=N;"),
        ("vec4 v = vec4(0.0, 10.0, 100, 0);", "vec4 v=vec4(0.,10.,100,0);"),
    ],
)
def test_what_only_readers_need_goes(text, wanted):
    assert dense(text, renamed=False) == f"// Made with sdf2vec\n{wanted}\n"


def test_declared_names_are_short_and_members_stay():
    text = (
        "float blend(vec2 place) { return place.x + sin(place.y); }\nvoid mainImage() { blend(vec2(1.0)); }"
    )
    assert dense(text, renamed=True).splitlines()[1] == (
        "float b(vec2 a){return a.x+sin(a.y);}void mainImage(){b(vec2(1.));}"
    )


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("target", ["shadertoy", "glsl", "wgsl"])
def test_the_smallest_text_draws_the_same(target, compositing, require_engine):
    trip = ROUND_TRIPS[target][0]
    require_engine(trip.engine)
    scene = random_scene(compositing=compositing, layers=9, seed=4)
    made = sdf2vec.exported(scene, target, framing="fit", max_bytes=10)
    assert len(made.raw) < 0.8 * len(sdf2vec.exported(scene, target, framing="fit").raw)
    assert compare(trip, made, scene, (60, 40)).largest_error < 0.25 + made.error
    assert compare(trip, made, scene, (31, 53)).largest_error < 0.25 + made.error


def test_a_limit_is_met_by_the_first_text_that_does():
    scene = random_scene(layers=9, seed=4)
    free = sdf2vec.exported(scene, "glsl")
    assert sdf2vec.exported(scene, "glsl", max_bytes=len(free.raw)).data == free.data
    limited = sdf2vec.exported(scene, "glsl", max_bytes=len(free.raw) - 1)
    assert limited.met
    assert len(limited.raw) < len(free.raw)
