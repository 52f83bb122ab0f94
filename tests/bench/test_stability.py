"""The quick half of the catalogue: ours does not fail; the textbook's ways, where they cost nothing, do."""

import json

import pytest

from sdf2vec.bench import stability
from sdf2vec.bench.catalogue import CASES
from sdf2vec.bench.stability import attempted

QUICK = {case.name: case for case in CASES if case.seeds}
NUMBERS = (
    "smooth minimum, large d/k",
    "singular points",
    "FLIP's clamps",
    "1 to 16 pixels a side",
    "half precision in shaders",
    "8 bits, translucent layers",
)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", QUICK)
def test_ours_does_not_fail(name):
    case = QUICK[name]
    assert [seed for seed in range(case.seeds) if attempted(case.ours, seed).failed] == []


@pytest.mark.parametrize("name", NUMBERS)
def test_textbooks_fail(name):
    case = next(case for case in CASES if case.name == name)
    assert any(attempted(case.theirs, seed).failed for seed in range(3))


def test_the_catalogue_is_gone_on_with(tmp_path):
    name = "smooth minimum, large d/k"
    said: list[str] = []
    assert not stability.run(tmp_path, 2, name, said.append)
    kept = json.loads((tmp_path / stability.KEPT).read_text())
    kept["ours"][name]["failed"][0] = True  # as if it had
    (tmp_path / stability.KEPT).write_text(json.dumps(kept))
    assert stability.run(tmp_path, 3, name, said.append)
    assert said[-1] == f"1/1 {name}: theirs fails 3 times, ours 1 of 3"
    assert "| 3 of 3 | 1 of 3 |" in (tmp_path / stability.PAGE).read_text()
    assert (tmp_path / stability.CHART).stat().st_size > 1000


def test_an_error_is_a_failure():
    def broken(seed):
        raise ValueError(seed)

    assert attempted(broken, 0).failed
