"""The bench of many shapes measures what it says."""

import pytest

from sdf2vec import load
from sdf2vec.bench import many_shapes
from sdf2vec.bench.export_worker import FORMS, export, scattered
from sdf2vec.bench.many_shapes import Took, row
from sdf2vec.export import EXPORTERS


def test_what_is_exported_has_so_many_shapes(tmp_path):
    export("json", 7, str(tmp_path / "seven"))
    assert load(str(tmp_path / "seven")) == scattered(7)
    assert scattered(7).shape_count == 7


def test_a_process_that_fails_says_why(monkeypatch):
    took = {5: Took(1.25, 99.6, 1234), 6: Took(0.0, 0.0, 0, "Error: too many")}
    monkeypatch.setattr(many_shapes, "took", lambda form, count: took[count])
    assert row("svg", [5, 6]) == "| svg | 1.2 s, 100 MB, 1,234 B | Error: too many |"


@pytest.mark.parametrize("form", FORMS)
def test_every_form_is_a_target_with_options(form):
    target, options = FORMS[form]
    assert target in EXPORTERS
    assert set(options) <= {"layout", "svg_profile"}
