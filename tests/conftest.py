"""Fixtures that all tests share."""

import os
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec

import pytest

from sdf2vec.bench.peers import PEERS
from sdf2vec.engines import ENGINES, glslang, svgo

MISSING = {name: engine.missing for name, engine in ENGINES.items()} | {
    "glslang": glslang.missing,
    "svgo": svgo.missing,
    "geometrize": lambda: None if PEERS["geometrize"].found() else "geometrizejs is not here: make test",
    "triton": lambda: None if find_spec("triton") else "not installed",
}


@pytest.fixture
def require_engine() -> Callable[[str], None]:
    """A function that lets a test go on only where the named engine works.

    It skips on a user's machine and fails where the environment variable CI says that nothing may be missing.
    """
    return _require_engine


@pytest.fixture
def triton(require_engine: Callable[[str], None]) -> None:
    """What runs Triton's kernels goes on only where there is one."""
    require_engine("triton")


@pytest.fixture
def kernels_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit finds its kernels compiled, whatever has run before: else the first that it says is that it compiles."""
    monkeypatch.setattr(import_module("sdf2vec.render.kernels"), "is_compiled", lambda *arguments: True)


def _require_engine(name: str) -> None:
    reason = MISSING[name]()
    if reason is None:
        return
    if os.environ.get("CI", "").lower() not in ("", "0", "false", "no"):
        pytest.fail(f"{name}: {reason}")
    pytest.skip(f"{name}: {reason}")
