"""The machine code of kernels: kept, found again, compiled anew where stale or damaged, and the same each time."""

import os
import shutil
import subprocess
import sys

import pytest

from sdf2vec.cached import cache_folder, files, trim
from sdf2vec.kernel_cache import Assembly
from sdf2vec.layer import Part
from sdf2vec.render import kernels

RUN = """
import sys, warnings
warnings.simplefilter("always")
import numpy as np
from sdf2vec import kernel_cache
from sdf2vec.kernel_cache import Assembly
from sdf2vec.lower.llvm import assembled
kernel_cache.Assembly._compiled = lambda self, made=Assembly._compiled: compiled.append(self) or made(self)
compiled, text = [], "define i64 @f() {\\n  ret i64 2\\n}"
one, other = (Assembly(assembled([each])) for each in (text, text.replace("2", "3")))
before = one.is_kept
import ctypes
def call(assembly):
    return ctypes.CFUNCTYPE(ctypes.c_int64)(assembly["f"].address)()
print(call(one), call(other), call(one), before, one.is_kept, len(compiled))
"""


def run(script, folder, *arguments):
    """What a script prints and warns of in a process of its own, with a cache folder."""
    environment = {**os.environ, "SDF2VEC_CACHE": str(folder)}
    command = [sys.executable, "-c", script, *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True)


def test_kernels_are_kept_in_the_cache_folder(tmp_path):
    assert run(RUN, tmp_path / "new").stdout.split() == ["2", "3", "2", "False", "True", "2"]
    assert len(list((tmp_path / "new").glob("*.kernel"))) == 2
    assert run(RUN, tmp_path / "new").stdout.split() == ["2", "3", "2", "True", "True", "0"]


@pytest.mark.parametrize(
    "damage", [lambda data: b"", lambda data: data[:-9] + b"x" * 9], ids=["empty", "overwritten"]
)
def test_damaged_machine_code_is_compiled_anew(tmp_path, damage):
    run(RUN, tmp_path)
    for path in tmp_path.glob("*.kernel"):
        path.write_bytes(damage(path.read_bytes()))
    result = run(RUN, tmp_path)
    assert result.stdout.split() == ["2", "3", "2", "True", "True", "2"]
    assert result.stderr == ""
    assert run(RUN, tmp_path).stdout.split()[-1] == "0"  # it was kept again


def test_without_a_cache_folder_kernels_work_with_one_warning(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    result = run(RUN, tmp_path / "file" / "inside")
    assert result.stdout.split() == ["2", "3", "2", "False", "False", "2"]
    assert result.stderr.count("Sdf2vecWarning") == 1
    assert "compiled anew in every run" in result.stderr


def test_machine_code_that_others_may_have_written_is_compiled_anew(tmp_path):
    run(RUN, tmp_path)
    for path in tmp_path.glob("*.kernel"):
        path.chmod(0o666)
    assert run(RUN, tmp_path).stdout.split()[-1] == "2"
    assert run(RUN, tmp_path).stdout.split()[-1] == "0"  # written anew, with other permissions


def test_the_folder_does_not_grow_without_bound(tmp_path, monkeypatch):
    monkeypatch.setenv("SDF2VEC_CACHE", str(tmp_path))
    names = ["old.kernel", "middle.kernel", "kernels_new.py", "of another.txt"]
    for age, name in enumerate(reversed(names)):
        (tmp_path / name).write_bytes(bytes(600_000))
        os.utime(tmp_path / name, (1e9 - age, 1e9 - age))
    assert [path.name for path, _ in files()] == names[:3]
    monkeypatch.setenv("SDF2VEC_CACHE_MEGABYTES", "1")
    assert trim() == 2
    assert sorted(os.listdir(tmp_path)) == ["kernels_new.py", "of another.txt"]
    assert trim() == 0


def test_saving_a_kernel_trims_the_folder(tmp_path, monkeypatch):
    (tmp_path / "old.kernel").write_bytes(bytes(2_000_000))
    os.utime(tmp_path / "old.kernel", (1e9, 1e9))
    monkeypatch.setenv("SDF2VEC_CACHE_MEGABYTES", "1")
    run(RUN, tmp_path)
    assert not (tmp_path / "old.kernel").exists()
    assert len(list(tmp_path.glob("*.kernel"))) == 2


def test_the_folder_is_the_users_unless_another_is_named(monkeypatch):
    monkeypatch.setenv("SDF2VEC_CACHE", "/elsewhere")
    assert str(cache_folder()) == "/elsewhere"
    monkeypatch.delenv("SDF2VEC_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", "/its/cache")
    assert sys.platform != "linux" or str(cache_folder()) == "/its/cache/sdf2vec"


# --- fingerprints -------------------------------------------------------------------------------------------


def test_machine_code_is_found_by_its_text_and_what_compiles_it(monkeypatch):
    one, same, other = (Assembly(text) for text in ("a", "a", "b"))
    assert one.path == same.path != other.path
    for name, value in (
        ("llvmlite.__version__", "0"),
        ("sdf2vec.kernel_cache._processor", lambda: ("z80", "")),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(name, value)
            assert Assembly("a").path != one.path


def test_kernels_of_other_formulas_are_other_kernels():
    one, other = (kernels.drawing((Part("circle"),), mode, 3)[0] for mode in ("over", "additive"))
    assert one.assembly.path != other.assembly.path


# --- digits -------------------------------------------------------------------------------------------------

FIT = """
import hashlib, numpy, sdf2vec
from sdf2vec.fit.presets import PRESETS
PRESETS["fast"] = PRESETS["fast"].paced(0.03)
pixels = numpy.random.default_rng(0).random((20, 30, 3))
scene = sdf2vec.fit(pixels, 9, kind="circle", preset="fast")
print(hashlib.sha256(sdf2vec.dumps(scene).encode()).hexdigest())
"""


def test_kernels_from_disk_and_fresh_ones_give_the_same_scene(tmp_path):
    """Kernels compiled now, read back, or compiled partly in another run: the same digits."""
    new, partly = tmp_path / "new", tmp_path / "partly"
    found = [run(FIT, new).stdout for _ in range(2)]
    partly.mkdir()
    kept = sorted(path.name for path in new.glob("*.kernel"))
    for name in kept[::2]:
        shutil.copy2(new / name, partly)
    found.append(run(FIT, partly).stdout)
    assert len(kept) > 2
    assert sorted(path.name for path in partly.glob("*.kernel")) == kept
    assert found[0]
    assert len(set(found)) == 1
