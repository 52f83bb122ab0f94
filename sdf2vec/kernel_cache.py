"""How kernels for the CPU are compiled, and where their machine code is kept: the user's cache folder.

`kernel` compiles what Python calls, `entry` what kernels `call` by its address, so that they need not be compiled
with it, and `inlined` what both are made of. Machine code is found again by a
fingerprint of all that was compiled into it, so that a kernel may call what another module defines; numba's own
`cache=True` looks at one file's time of change only. Where the folder can't be written to, kernels are compiled anew
in every run, with one warning.
"""

from __future__ import annotations

import hashlib
import importlib.util
import pickle
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FunctionType, ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import caching, ccallback, compiler, serialize
from numba.extending import intrinsic

from .cached import cache_folder, read_kept, trim
from .errors import Sdf2vecError, Sdf2vecWarning
from .files import write_atomically

FLAGS: dict[str, Any] = {
    "fastmath": {"reassoc", "nsz", "arcp", "contract", "afn"},
    "error_model": "numpy",  # what lets LLVM vectorise divisions
    "nogil": True,
}
UNWRAPPED: dict[str, Any] = {"no_cfunc_wrapper": True}  # nothing calls it from C
DIGEST = hashlib.sha256().digest_size

inlined: Callable[[Callable[..., Any]], Any] = numba.njit(**FLAGS, forceinline=True)


def kernel(function: FunctionType) -> Any:
    """Decorator: compiled when first called; the machine code is kept.

    What it calls is to be `inlined`: were that kept, too, a fresh compilation and one from disk could link different
    copies of a function, which differ in the last digits.
    """
    dispatcher: Any = numba.njit(**FLAGS, **UNWRAPPED)(function)
    dispatcher._cache = _Kept(function)
    return dispatcher


@dataclass(frozen=True)
class Entry:
    """A function that kernels call by its address: compiled when that is first asked for; its machine code is kept."""

    py_func: FunctionType
    signature: Any

    @property
    def address(self) -> int:
        return int(self._compiled.address)

    @cached_property
    def _compiled(self) -> Any:
        signature = self.signature.args, self.signature.return_type
        function: Any = ccallback.CFunc(self.py_func, signature, {}, FLAGS)
        function._cache = _Kept(self.py_func)
        function.compile()
        return function


def entry(*arguments: Any) -> Callable[[FunctionType], Entry]:
    """Decorator: an `Entry` that takes arguments of these types and returns nothing; arrays as pointers to their
    first number."""
    return lambda function: Entry(function, types.void(*arguments))


@intrinsic
def call(_: Any, address: Any, arguments: Any) -> Any:
    """Calls the `Entry` at an address with a tuple of arguments, whose types have to be as it was declared with."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        given = [builder.extract_value(values[1], index) for index in range(len(arguments))]
        for index, kind in enumerate(arguments):
            if isinstance(kind, types.Array):
                given[index] = context.make_array(kind)(context, builder, given[index]).data
        result = context.get_value_type(signature.return_type)
        function = ir.FunctionType(result, [value.type for value in given])
        return builder.call(builder.inttoptr(values[0], function.as_pointer()), given)

    return types.void(address, arguments), generate


@cache
def load(source: str) -> ModuleType:
    """The module of this text. Its kernels are compiled when they are first called."""
    module = ModuleType(f"sdf2vec_{_hash(source)}")
    sys.modules[module.__name__] = module  # numba looks there for the module of what it has kept
    exec(compile(source, module.__name__, "exec"), module.__dict__)
    return module


@cache
def load_file(source: str) -> ModuleType:
    """The module of this text, always from a file: Triton reads the text of its functions from there.

    Without a cache folder the file is in a temporary one, which is removed when the program ends.
    """
    path = cache_folder() / f"kernels_{_hash(source)}.py"
    try:
        if not path.exists():
            write_atomically(path, source.encode())
    except (Sdf2vecError, OSError):
        _warn_once(cache_folder())
        path = Path(_temporary_folder().name) / path.name
        write_atomically(path, source.encode())
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


def is_compiled(dispatcher: Any) -> bool:
    """Whether a kernel has been compiled before on this machine."""
    return any(cache_folder().glob(f"{_stem(dispatcher.py_func)}-*"))


class _Kept(caching.NullCache):
    """The machine code of one kernel, a file for each signature: a digest, then what numba makes of it."""

    def __init__(self, function: FunctionType) -> None:
        self.function = function

    def load_overload(self, signature: object, target: Any) -> Any:
        """What was compiled for a signature; None where there is nothing, or it is damaged, or made of a module whose
        name is another now: a remark in generated text is enough for that."""
        target.refresh()
        try:
            data = read_kept(self._path(signature, target.codegen()))
            if hashlib.sha256(data[DIGEST:]).digest() != data[:DIGEST]:
                return None
            return compiler.CompileResult._rebuild(target, *pickle.loads(data[DIGEST:]))
        except Exception:  # whatever it is, compiling mends it
            return None

    def save_overload(self, signature: object, compiled: Any) -> None:
        """Keeps what was compiled for a signature."""
        data = serialize.dumps(compiled._reduce())
        try:
            path = self._path(signature, compiled.codegen)
            write_atomically(path, hashlib.sha256(data).digest() + data)
            trim()
        except (Sdf2vecError, OSError):
            _warn_once(cache_folder())

    def _path(self, signature: object, codegen: Any) -> Path:
        name = f"{_stem(self.function)}-{_hash(signature, codegen.magic_tuple())}.kernel"
        return cache_folder() / name


@cache
def _stem(function: FunctionType) -> str:
    """How the files of a kernel begin; differs where what was compiled, or what compiles, differs."""
    versions = numba.__version__, llvmlite.__version__, np.__version__, sys.version
    flags = sorted(map(str, FLAGS["fastmath"]))
    return f"{function.__module__}.{function.__name__}-{_hash(*versions, *flags, *_parts(function))}"


def _parts(function: FunctionType) -> Iterator[object]:
    """The code and the constants of a function and of all compiled ones that it calls."""
    code = function.__code__
    yield from (code.co_code, code.co_consts, code.co_names)
    for name in code.co_names:
        value: Any = function.__globals__.get(name)
        if isinstance(value, (bool, int, float, tuple, np.generic, np.ndarray)):
            yield from (np.asarray(value).dtype, np.asarray(value).tolist())
        elif hasattr(value, "py_func"):
            yield from _parts(value.py_func)


def _hash(*parts: object) -> str:
    return hashlib.sha256("\n".join(map(repr, parts)).encode()).hexdigest()[:20]


@cache
def _temporary_folder() -> TemporaryDirectory[str]:
    return TemporaryDirectory(prefix="sdf2vec-")


@cache
def _warn_once(folder: Path) -> None:
    warnings.warn(
        f"cannot write to {folder}: kernels are compiled anew in every run; SDF2VEC_CACHE names another folder",
        Sdf2vecWarning,
        stacklevel=4,
    )
