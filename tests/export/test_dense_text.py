"""Shader text in few bytes: shorter, and the same picture in an engine."""

import pytest

import sdf2vec
from sdf2vec.export.dense_text import dense
from sdf2vec.roundtrip import ROUND_TRIPS, compare
from sdf2vec.shapes import KINDS
from tests.scenes import random_scene


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("float a = 0.50; // half", "float a=.5;"),
        ("/* two\nlines */ x = 1.0 - -y;", "x=1.- -y;"),
        ("for (int i = 0; i < 10; i++) c += d.x;", "for(int i=0;i<10;i++)c+=d.x;"),
        ("a = 1e-20;\n#define N 3\nb = N;", "a=1e-20;\n#define N 3\nb=N;"),
        ("vec4 v = vec4(0.0, 10.0, 100, 0);", "vec4 v=vec4(0,10,100,0);"),
        ("v = vec3f(0.50, a * 2.0, f(1.0)) + f(3.0, 1.0);", "v=vec3f(.5,a*2.,f(1.))+f(3.,1.);"),
        ("v = vec2(f(vec2(2.0), 3.0).x, 4.0);", "v=vec2(f(vec2(2),3.).x,4);"),
    ],
)
def test_what_only_readers_need_goes(text, wanted):
    assert dense(text, renamed=False) == f"// Made with sdf2vec\n{wanted}\n"


def test_declared_names_are_short_and_members_stay():
    text = (
        "float blend(vec2 place) { return place.x + sin(place.y); }\nvoid mainImage() { blend(vec2(1.0)); }"
    )
    assert dense(text, renamed=True).splitlines()[1] == (
        "float a(vec2 b){return b.x+sin(b.y);}void mainImage(){a(vec2(1));}"
    )


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (  # each function has names of its own, which may be the same; what all see keeps its
            "int kept; float one(float first) { return first + kept; } float two(float second) { return second; }",
            "int a;float b(float d){return d+a;}float c(float d){return d;}",
        ),
        (  # behind commas, within loops, and with what is around them in brackets
            "void go() { vec2 low = vec2(here, far), high = low; for (int at = 0, i = 0; at < 3; at++) low += high; }",
            "void a(){vec2 b=vec2(here,far),d=b;for(int c=0,e=0;c<3;c++)b+=d;}",
        ),
        (  # a parameter hides what is outside; what a text does not declare has its name to itself
            "int same; int f(int same) { return same + a + b; } int g() { return same; }",
            "int c;int d(int f){return f+a+b;}int e(){return c;}",
        ),
        (
            "float far;\n#define NEAR far\nfloat end() { return NEAR; }",
            "float a;\n#define NEAR a\nfloat b(){return NEAR;}",
        ),
        ("void go(out vec4 one, in vec2 two) { one.x = two.x; }", "void a(out vec4 b,in vec2 c){b.x=c.x;}"),
    ],
)
def test_names_are_short_where_they_are_seen(text, wanted):
    assert dense(text, renamed=True).split("\n", 1)[1] == f"{wanted}\n"


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("float a = 1.0; float b = a; vec2 c; vec2 d[2]; int e;", "float a=1.,b=a;vec2 c,d[2];int e;"),
        ("float a; float f(float x) { float b; return b; }", "float a;float f(float x){float b;return b;}"),
        ("const int a = 1; int b; a = b; int c;", "const int a=1;int b;a=b;int c;"),
        ("for (int i = 0; i < 3; i++) { int a; int b; } int c;", "for(int i=0;i<3;i++){int a,b;}int c;"),
    ],
)
def test_names_of_one_type_are_declared_together(text, wanted):
    assert dense(text, renamed=False) == f"// Made with sdf2vec\n{wanted}\n"


@pytest.mark.parametrize("compositing", ["over", "additive"])
@pytest.mark.parametrize("target", ["shadertoy", "glsl", "wgsl"])
def test_the_smallest_text_draws_the_same(target, compositing, require_engine):
    trip = ROUND_TRIPS[target][0]
    require_engine(trip.engine)
    kinds = [
        kind for kind in KINDS if kind != "arc"
    ]  # with arcs, words of few bits would be smaller than numbers
    scene = random_scene(kinds, compositing=compositing, layers=9, seed=4)
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
