"""What engines have in common: sizes that are refused, what is said of a missing one; and glslang's verdicts."""

import subprocess
import sys
from dataclasses import replace

import pytest

from sdf2vec.engines import ENGINES, EngineError, engine, glslang_validate
from tests import conftest
from tests.engines.known_pixels import GLSL_POSITION, glsl


def test_glslang_judges(require_engine):
    require_engine("glslang")
    assert glslang_validate(glsl("300 es", GLSL_POSITION)) is None
    said = glslang_validate(glsl("300 es", GLSL_POSITION).replace("1000.25", "nonsense"))
    assert said is not None
    assert said.startswith("ERROR: 0:5: 'nonsense'")


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("size", [(0, 1), (1, -1), (100_000, 1), (16_000, 16_000)])
def test_absurd_sizes(name, size):
    with pytest.raises(EngineError, match="cannot draw"):
        ENGINES[name].render("", *size)


def test_reason_is_one_line_with_advice():
    def no_package():
        raise ModuleNotFoundError("No module named 'wgpu'", name="wgpu")

    def no_driver():
        raise OSError("cannot open\nlibEGL.so")

    assert engine.reason_missing(lambda: None, "advice") is None
    assert engine.reason_missing(no_package, "advice") == (
        "the Python package wgpu is not installed: pip install 'sdf2vec[check]'"
    )
    assert engine.reason_missing(no_driver, "do this") == "cannot open libEGL.so; do this"


def test_render_on_a_missing_engine():
    def probe():
        raise OSError("no driver")

    with pytest.raises(EngineError, match="no driver"):
        replace(ENGINES["opengl"], probe=probe).render(glsl("330", GLSL_POSITION), 2, 2)


@pytest.mark.parametrize(
    ("ci", "outcome"),
    [("", pytest.skip.Exception), ("0", pytest.skip.Exception), ("true", pytest.fail.Exception)],
)
def test_missing_engine_skips_for_a_user_and_fails_in_ci(monkeypatch, require_engine, ci, outcome):
    monkeypatch.setenv("CI", ci)
    monkeypatch.setitem(conftest.MISSING, "opengl", lambda: "no driver")
    with pytest.raises(outcome, match="opengl: no driver"):
        require_engine("opengl")


def test_engines_come_without_torch_and_packages():
    packages = {"torch", "moderngl", "wgpu", "resvg_py", "cairosvg", "playwright"}
    program = f"import sys, sdf2vec.engines; print({packages} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
