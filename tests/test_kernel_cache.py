"""The machine code of kernels: kept, found again, compiled anew where stale or damaged, and the same each time."""

import os
import subprocess
import sys
from types import FunctionType

import numpy as np
import pytest

from sdf2vec import kernel_cache
from sdf2vec.cached import cache_folder, files, trim
from sdf2vec.layer import Part
from sdf2vec.render import kernels

RUN = """
import warnings
warnings.simplefilter("always")
from sdf2vec import kernel_cache
from sdf2vec.layer import Part
source = "from sdf2vec.kernel_cache import kernel\\n@kernel\\ndef f(x):\\n    return x + 1\\n"
module, other = kernel_cache.load(source), kernel_cache.load(source.replace("+ 1", "+ 2"))
before = kernel_cache.is_compiled(module.f)
print(module.f(1), other.f(1), before, kernel_cache.is_compiled(module.f), len(module.f.stats.cache_hits))
"""


def run(script, folder, *arguments):
    """What a script prints and warns of in a process of its own, with a cache folder."""
    environment = {**os.environ, "SDF2VEC_CACHE": str(folder)}
    command = [sys.executable, "-c", script, *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True)


def test_kernels_are_kept_in_the_cache_folder(tmp_path):
    assert run(RUN, tmp_path / "new").stdout.split() == ["2", "3", "False", "True", "0"]
    assert len(list((tmp_path / "new").glob("*.kernel"))) == 2
    assert run(RUN, tmp_path / "new").stdout.split() == ["2", "3", "True", "True", "1"]


@pytest.mark.parametrize(
    "damage", [lambda data: b"", lambda data: data[:-9] + b"x" * 9], ids=["empty", "overwritten"]
)
def test_damaged_machine_code_is_compiled_anew(tmp_path, damage):
    first = run(RUN, tmp_path).stdout
    for path in tmp_path.glob("*.kernel"):
        path.write_bytes(damage(path.read_bytes()))
    result = run(RUN, tmp_path)
    assert result.stdout.split()[:2] == first.split()[:2]
    assert result.stderr == ""
    assert run(RUN, tmp_path).stdout.split()[-1] == "1"  # it was kept again


CALLS_A_MODULE = """
import sys
from sdf2vec import kernel_cache
source = "from sdf2vec.kernel_cache import inlined\\n@inlined\\ndef twice(x):\\n    return 2 * x\\n"
twice = kernel_cache.load(source + sys.argv[1]).twice
@kernel_cache.kernel
def f(x):
    return twice(x)
print(f(1), len(f.stats.cache_hits))
"""


def test_machine_code_of_a_module_that_is_gone_is_compiled_anew(tmp_path):
    """Another version's text may say the same in other words: the module has another name then."""
    runs = [run(CALLS_A_MODULE, tmp_path, remark).stdout.split() for remark in ("", "", "# other", "# other")]
    assert runs == [["2", "0"], ["2", "1"], ["2", "0"], ["2", "1"]]


def test_without_a_cache_folder_kernels_work_with_one_warning(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    result = run(RUN, tmp_path / "file" / "inside")
    assert result.stdout.split() == ["2", "3", "False", "False", "0"]
    assert result.stderr.count("Sdf2vecWarning") == 1
    assert "compiled anew in every run" in result.stderr


def test_machine_code_that_others_may_have_written_is_compiled_anew(tmp_path):
    first = run(RUN, tmp_path).stdout
    for path in tmp_path.glob("*.kernel"):
        path.chmod(0o666)
    assert run(RUN, tmp_path).stdout.split()[-1] == "0"
    assert run(RUN, tmp_path).stdout.split()[-1] == "1"  # written anew, with other permissions
    assert first.split()[:2] == ["2", "3"]


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

CALLED = """
import numpy as np
from sdf2vec.kernel_cache import inlined, kernel
TABLE, SCALE = np.array([1, 2]), np.float32(3)
@inlined
def helper(x):
    return x * SCALE + TABLE[0]
@kernel
def f(x):
    return helper(x)
"""


ENTRY = """
from numba import carray, types
from sdf2vec.kernel_cache import call, entry, kernel
@entry(types.CPointer(types.float32), types.int64)
def double(numbers, count):
    for i in range(count):
        carray(numbers, count)[i] *= 2
@kernel
def run(address, numbers, count):
    call(address, (numbers, count))
"""


def stem(source):
    """How the files of f are named, with the module's own name left out."""
    function = kernel_cache.load(source).f.py_func
    return kernel_cache._stem(function).removeprefix(function.__module__)


def test_equal_code_has_one_fingerprint():
    assert stem(CALLED) == stem(CALLED + "\n# a remark\n")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("* SCALE", "- SCALE"),
        ("float32(3)", "float32(4)"),
        ("[1, 2]", "[1, 3]"),
        ("return h", "return 1 + h"),
    ],
)
def test_fingerprints_differ_with_all_that_is_compiled_in(old, new):
    assert stem(CALLED) != stem(CALLED.replace(old, new))


def test_fingerprints_differ_with_what_compiles(monkeypatch):
    before = stem(CALLED)
    kernel_cache._stem.cache_clear()
    monkeypatch.setattr("numba.__version__", "0")
    assert stem(CALLED) != before
    kernel_cache._stem.cache_clear()


def test_kernels_of_other_formulas_are_other_kernels():
    one, other = (kernels.drawing((Part("circle"),), mode, 3)[0] for mode in ("over", "additive"))
    assert isinstance(one.py_func, FunctionType)
    assert kernel_cache._stem(one.py_func) != kernel_cache._stem(other.py_func)


def test_an_entry_is_called_by_its_address():
    """Arrays are handed over as pointers to their first number; the machine code is kept."""
    module = kernel_cache.load(ENTRY)
    numbers = np.arange(4, dtype=np.float32)
    module.run(module.double.address, numbers[1:], 2)
    assert list(numbers) == [0, 2, 4, 3]
    assert kernel_cache.is_compiled(module.double)


# --- digits -------------------------------------------------------------------------------------------------

FIT = """
import sys, hashlib, numpy, torch, sdf2vec
from sdf2vec.render import fused
from sdf2vec.render.tensors import from_scene
pixels = numpy.random.default_rng(0).random((40, 60, 3))
if sys.argv[1] == "draw":
    one = sdf2vec.Shape.of("circle", (1, 0, 0), center=(0, 0), radius=0.3)
    with torch.no_grad():
        fused.composite(from_scene(sdf2vec.Scene(9, 9, (sdf2vec.Layer((one,), 0.1),))), 9, 9)
else:
    scene = sdf2vec.fit(pixels, 9, kind="circle", preset="fast")
    print(hashlib.sha256(sdf2vec.dumps(scene).encode()).hexdigest())
"""


def test_kernels_from_disk_and_fresh_ones_give_the_same_scene(tmp_path):
    """Kernels compiled now, read back, or compiled partly in another run: the same digits."""
    run(FIT, tmp_path / "partly", "draw")
    found = [run(FIT, tmp_path / folder, "fit").stdout for folder in ("new", "new", "partly")]
    assert found[0]
    assert len(set(found)) == 1


def test_a_kernel_returns_what_python_does():
    function = kernel_cache.load(CALLED).f
    assert function(np.float32(2)) == 7
