"""What is read from any tool's SVG: elements, kinds, numbers; text as vtracer writes it among it."""

import numpy as np
import pytest

from sdf2vec.bench.recovery import svg_answer
from sdf2vec.bench.svg_shapes import count_numbers, kind_of, matrix_of, parsed, shapes_of
from sdf2vec.engines import EngineError

BACKGROUND = "M0 0 C13.2 0 26.4 0 40 0 C40 13.2 40 26.4 40 40 C26.8 40 13.6 40 0 40 C0 26.8 0 13.6 0 0 Z "
RECTANGLE = "M0 0 C6.6 0 13.2 0 20 0 C20 3.3 20 6.6 20 10 C13.4 10 6.8 10 0 10 C0 6.7 0 3.4 0 0 Z "
TRACED = f"""<?xml version="1.0" encoding="UTF-8"?>
<!-- Generator: visioncortex VTracer 0.6.5 -->
<svg version="1.1" xmlns="http://www.w3.org/2000/svg" width="40" height="40">
<path d="{BACKGROUND}" fill="#204060" transform="translate(0,0)"/>
<path d="{RECTANGLE}" fill="#FF8000" transform="translate(10,5)"/>
<path d="M0 0 L10 10 L0 10 Z " fill="#00FF00" transform="translate(4,25)"/>
</svg>
"""


def svg(body):
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 40">{body}</svg>'


def kinds(body):
    return [kind_of(drawn) for drawn in shapes_of(parsed(svg(body)))]


def test_what_vtracer_writes(require_engine):
    """The path that covers all is no shape; of the others one is plainly a triangle."""
    require_engine("resvg")
    answer = svg_answer(TRACED, 40)
    assert [found.kind for found in answer.shapes] == [None, "triangle"]
    box, triangle = (found.cover for found in answer.shapes)
    assert box.sum() == pytest.approx(200, abs=0.1)
    assert box[5:15, 10:30].min() == 1
    assert triangle.sum() == pytest.approx(50, abs=1.5)  # few levels of antialiasing
    np.testing.assert_allclose(answer.pixels[10, 20], (1, 128 / 255, 0), atol=1e-6)
    np.testing.assert_allclose(answer.pixels[30, 30], np.array([0x20, 0x40, 0x60]) / 255, atol=1e-6)


def test_opacity_and_size(require_engine):
    """A disc alone, drawn larger: coverage is 1 in it, whatever its opacity."""
    require_engine("resvg")
    (found,) = svg_answer(svg('<circle cx="20" cy="20" r="10" opacity="0.5"/>'), 80).shapes
    assert found.opacity == pytest.approx(0.5, abs=0.003)
    assert found.cover.max() == 1
    assert found.cover.sum() == pytest.approx(np.pi * 400, rel=0.005)


def test_what_is_not_seen_is_no_shape(require_engine):
    require_engine("resvg")
    body = '<rect width="40" height="40" fill="none"/><circle cx="200" cy="20" r="10"/><rect width="9" height="9"/>'
    assert [found.kind for found in svg_answer(svg(body), 40).shapes] == ["box"]


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ('<circle cx="9" cy="9" r="3"/>', ["circle"]),
        ('<ellipse rx="4" ry="3"/><ellipse rx="3" ry="3"/>', ["ellipse", "circle"]),
        ('<g transform="translate(5 5) rotate(30) scale(4 2)"><ellipse rx="1" ry="1"/></g>', ["ellipse"]),
        ('<ellipse rx="4" ry="2" transform="rotate(30) scale(1,2)"/>', ["circle"]),
        ('<rect width="3" height="4" transform="rotate(45 1 1)"/>', ["box"]),
        ('<rect width="3" height="4" transform="skewX(30)"/>', [None]),
        ('<polygon points="0,0 9,0 4,7"/><polygon points="0 0 9 0 9 5 0 5"/>', ["triangle", "box"]),
        ('<polygon points="0,0 9,0 12,5 3,5"/>', [None]),
        (
            '<path d="M1 1L9 1L5 8Z"/><path d="m1 1h8v5h-8z"/><path d="M1,1 9,1 5,8"/>',
            ["triangle", "box", "triangle"],
        ),
        ('<path d="M0 0L5 0L9 0L4 7L0 0Z"/>', ["triangle"]),
        ('<path d="M0 0L9 0L4 7ZM20 20L29 20L24 27Z"/>', [None]),
        ('<path d="M0 0L9 0M9 5L0 5Z"/>', [None]),
        ('<path d="M0 0C1 1 2 2 9 0L4 7Z"/>', [None]),
        ('<path d="M0 0L9 0L12 5L4 9L-2 5Z"/>', [None]),
        ('<g opacity="0.5"><circle r="3"/></g>', ["circle"]),
        ('<g opacity="0.5"><circle r="3"/><circle r="4"/></g>', [None]),
        ('<defs><circle r="3"/></defs><title>no</title><g><g><rect width="3" height="3"/></g></g>', ["box"]),
        ("", []),
    ],
)
def test_kinds(body, expected):
    assert kinds(body) == expected


@pytest.mark.parametrize(
    ("transform", "point"),
    [
        ("", (3, 1)),
        ("translate(4)", (7, 1)),
        ("translate(4,5) scale(2)", (10, 7)),
        ("scale(2,3)", (6, 3)),
        ("rotate(90)", (-1, 3)),
        ("rotate(90 3 0)", (2, 0)),
        ("matrix(1 2 3 4 5 6)", (11, 16)),
        ("skewX(45)", (4, 1)),
        ("skewY(45)", (3, 4)),
    ],
)
def test_transforms_by_hand(transform, point):
    """Where the point (3, 1) comes to lie."""
    np.testing.assert_allclose(matrix_of(transform) @ (3, 1, 1), (*point, 1), atol=1e-12)


@pytest.mark.parametrize(
    ("body", "count"),
    [
        ('<path d="M1 2L-3.5.5Z"/>', 4),
        ('<path d="M1-2a4 4 0 01.5.5 4,4,0,1,1,2-2z"/>', 16),
        ('<circle cx="1" cy="2" r="3" fill="#123456" opacity="0.5"/>', 3),
        ('<rect x="1" y="2" width="3" height="4" rx="1" transform="rotate(30 1 2)"/>', 8),
        ('<polygon points="1,2 3,4 5,6"/>', 6),
        ('<mask x="0" y="0" width="9" height="9"><circle r="3"/></mask>', 1),
        (
            '<defs><linearGradient id="a" x1="0" x2="1"><stop offset="0.5" stop-color="#123"/></linearGradient></defs>',
            3,
        ),
    ],
)
def test_numbers_by_hand(body, count):
    assert count_numbers(svg(body)) == count


def test_text_that_is_no_svg():
    with pytest.raises(EngineError, match="not well-formed"):
        count_numbers("<svg")
