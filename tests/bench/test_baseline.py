"""Fits have not become worse: five small pictures, every kind, `fast`, against what was kept."""

from pathlib import Path

import pytest

from sdf2vec.bench.baseline import DROP, Figures, decibels, kept, worse

BEFORE = kept(Path(__file__).parent / "baseline.json")


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("kind", BEFORE.decibels)
def test_no_kind_has_become_worse(kind):
    assert decibels(kind) >= BEFORE.least(kind)


def test_what_is_worse_is_said():
    before = Figures(
        {"box": 20.0, "circle": 20.0}, {"box": 0.0, "circle": 0.0}, {"box": 30.0, "circle": 30.0}
    )
    better = Figures({"box": 19.8, "circle": 25.0}, {}, {"box": 21.0, "circle": 90.0})
    assert worse(before, better) == []
    assert worse(before, Figures({"box": 19.6, "circle": 20.0}, {}, {"box": 30.0, "circle": 19.0})) == [
        "box: 19.60 dB, 20.00 before",
        "circle: a step is 19 times faster than a dense one, 30 before",
    ]


def test_what_is_chance_is_not_worse():
    """Of means of six each with a spread of 1 dB, the difference's standard error is √(1/6 + 1/6); of one, √(7/6)."""
    before = Figures({"box": 20.0}, {"box": 1.0}, {})
    assert before.least("box") == pytest.approx(20 - DROP - 3 * 1.0801, abs=1e-3)
    least = 20 - DROP - 3 * 0.5774
    assert worse(before, Figures({"box": least + 0.01}, {}, {})) == []
    assert worse(before, Figures({"box": least - 0.01}, {}, {})) == [
        f"box: {least - 0.01:.2f} dB, 20.00 before"
    ]
