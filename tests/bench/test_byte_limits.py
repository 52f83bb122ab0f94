"""The bench of size limits: what other programs say in as many bytes."""

import stat

import numpy as np
import pytest

from sdf2vec.bench import byte_limits
from sdf2vec.bench.byte_limits import nearest_of
from sdf2vec.image import encode_png
from tests.bench.command import bench

# Called as primitive is: so many black columns of a pixel each on white, from the left.
COLUMNS = """#!/bin/sh
{ echo '<svg xmlns="http://www.w3.org/2000/svg" width="64" height="8">'
echo '<rect width="64" height="8" fill="#fff"/>'
i=0; while [ $i -lt $6 ]; do echo "<rect x=\\"$i\\" width=\\"1\\" height=\\"8\\"/>"; i=$((i+1)); done
echo '</svg>'; } > "$4"
"""


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "primitive"
    path.write_text(COLUMNS)
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


@pytest.fixture
def black(tmp_path, require_engine):
    require_engine("resvg")
    path = tmp_path / "black.png"
    path.write_bytes(encode_png(np.zeros((8, 64, 3), np.float32)))
    return path


@pytest.mark.parametrize("columns", [4, 16, 40])
def test_as_many_shapes_as_go_into_the_limit(columns, program, black):
    """So many columns are black of 64: the rest is what is wrong."""
    rows = [f'<rect x="{x}" width="1" height="8"/>' for x in range(columns)]
    ground = (
        '<svg xmlns="http://www.w3.org/2000/svg" width="64" height="8">',
        '<rect width="64" height="8" fill="#fff"/>',
    )
    most = sum(len(line) + 1 for line in (*ground, *rows, "</svg>"))
    wrong = {
        limit: 10 ** (-nearest_of("primitive", program, black, str(limit)) / 10) for limit in (most, most - 1)
    }
    assert wrong[most] == pytest.approx((64 - columns) / 64, abs=1e-6)
    assert wrong[most - 1] == pytest.approx((65 - columns) / 64, abs=1e-6)


def test_no_shape_where_there_is_room_for_none(program, black):
    assert nearest_of("primitive", program, black, "20") == pytest.approx(0.0, abs=1e-6)


def test_a_column_for_each_other_program(program, black, capsys, monkeypatch):
    monkeypatch.setitem(byte_limits.TARGETS, "svg", ("resvg",))
    asked = ("--targets", "svg", "--limits", "600", "--beside", "primitive", "--peer", f"primitive={program}")
    assert not bench("byte-limits", black, *asked)
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    head, _, row = ([cell.strip() for cell in line.split("|")[1:-1]] for line in rows)
    found = dict(zip(head, row, strict=True))
    near = nearest_of("primitive", program, black, "600")
    assert found["primitive dB"] == f"{near:.2f}"
    assert int(found["bytes"]) <= 600


def test_programs_that_do_not_grow_are_refused(black, capsys):
    assert bench("byte-limits", black, "--beside", "vtracer") == 2
    assert "primitive" in capsys.readouterr().err


def test_a_program_that_is_missing_is_said_before_anything_is_fitted(black, capsys, monkeypatch):
    monkeypatch.setitem(byte_limits.TARGETS, "svg", ("resvg",))  # whether a browser is there is told once
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(byte_limits, "measured", lambda *given, **options: pytest.fail("fitted"))
    assert bench("byte-limits", black, "--targets", "svg", "--beside", "primitive") == 2
    assert "primitive: not on this machine" in capsys.readouterr().err
