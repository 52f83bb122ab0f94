"""How kernels for the CPU are compiled, and where their machine code is kept: the user's cache folder.

Functions come as text, `Assembly`, made of formulas (`lower.llvm`) or of plain Python (`lower.loops`, by the decorator
`kernel`); LLVM compiles it for this machine when it is first needed. Machine code is found again by a hash of the text
and of what compiles it. Where the folder can't be written to, kernels are compiled anew in every run, with one warning.
"""

from __future__ import annotations

import ctypes
import hashlib
import importlib.util
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import RLock
from types import FunctionType, ModuleType
from typing import Any

import llvmlite
from llvmlite import binding

from .cached import cache_folder, read_kept, trim
from .errors import Sdf2vecError, Sdf2vecWarning
from .files import write_atomically
from .lower.llvm import assembled
from .lower.loops import Kind, arguments_of, result_of, text_of

DIGEST = hashlib.sha256().digest_size
C_TYPES: dict[str, Any] = {
    "float32": ctypes.c_float,
    "float64": ctypes.c_double,
    "int32": ctypes.c_int32,
    "int64": ctypes.c_int64,
}
_compiling = RLock()


@dataclass(frozen=True)
class Entry:
    """A function of an assembly."""

    assembly: Assembly
    name: str

    @cached_property
    def address(self) -> int:
        """Where its machine code is, from now on."""
        with _compiling:
            _add(self.assembly)
            return int(_machine().get_function_address(f"{self.assembly.stem}.{self.name}"))


@dataclass(frozen=True)
class Assembly:
    """Functions in LLVM's assembly language: compiled when an address is first asked for; machine code is kept."""

    text: str

    def __getitem__(self, name: str) -> Entry:
        return Entry(self, name)

    @property
    def is_kept(self) -> bool:
        """Whether it has been compiled before on this machine."""
        return self.path.exists()

    @cached_property
    def stem(self) -> str:
        """What the names of its functions begin with: all functions of a process are in one list."""
        return f"sdf2vec.{_hash(llvmlite.__version__, binding.llvm_version_info, *_processor(), self.text)}"

    @property
    def path(self) -> Path:
        """Where its machine code is kept."""
        return cache_folder() / f"{self.stem}.kernel"

    def code(self) -> bytes:
        """The machine code: what is kept, or compiled now."""
        return _read(self.path) or self._compiled()

    def _compiled(self) -> bytes:
        module = binding.parse_assembly(self.text)
        for function in module.functions:
            if not function.is_declaration:
                function.name = f"{self.stem}.{function.name}"
        target = _target_machine()
        builder = binding.create_pass_builder(target, _tuning())
        builder.getModulePassManager().run(module, builder)
        code: bytes = target.emit_object(module)
        _keep(self.path, code)
        return code


class Kernel:
    """A function that is compiled when it is first called, for arguments of the kinds that it states."""

    def __init__(self, function: FunctionType) -> None:
        self.py_func = function
        self.arguments = arguments_of(function)

    @cached_property
    def assembly(self) -> Assembly:
        """The function alone."""
        return Assembly(assembled([text_of(self.py_func)]))

    @cached_property
    def _compiled(self) -> Callable[..., Any]:
        types = [each for kind in self.arguments.values() for each in _c_types(kind)]
        result = result_of(self.py_func)
        prototype = ctypes.CFUNCTYPE(C_TYPES[result.dtype] if result else None, *types)
        return prototype(self.assembly[self.py_func.__name__].address)

    def __call__(self, *given: Any) -> Any:
        parts: list[Any] = []
        for (name, kind), value in zip(self.arguments.items(), given, strict=True):
            if not kind.dimensions:
                parts.append(value)
            elif value.dtype == kind.dtype and value.ndim == kind.dimensions and value.flags.c_contiguous:
                parts += value.__array_interface__["data"][0], *value.shape
            else:
                raise TypeError(f"{name}: {kind} wanted, got {value.dtype} {value.shape} {value.strides}")
        return self._compiled(*parts)


def kernel(function: Any) -> Kernel:
    """Decorator: what of Python it may be made of says `lower.loops`."""
    return Kernel(function)


def _c_types(kind: Kind) -> list[Any]:
    if not kind.dimensions:
        return [C_TYPES[kind.dtype]]
    return [ctypes.c_void_p, *[ctypes.c_int64] * kind.dimensions]


# --- LLVM ---------------------------------------------------------------------------------------------------


@cache
def _processor() -> tuple[str, str]:
    """Its name, and what it can do."""
    return binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()


def _target_machine() -> Any:
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    name, features = _processor()
    return binding.Target.from_default_triple().create_target_machine(name, features, opt=3, jit=True)


def _tuning() -> Any:
    tuning = binding.create_pipeline_tuning_options(speed_level=3)
    tuning.loop_vectorization = True
    return tuning


@cache
def _machine() -> Any:
    """What holds the machine code of this process."""
    target = _target_machine()
    return binding.create_mcjit_compiler(binding.parse_assembly(""), target)


@cache
def _add(assembly: Assembly) -> None:
    """To the functions of this process."""
    _machine().add_object_file(binding.ObjectFileRef.from_data(assembly.code()))
    _machine().finalize_object()


# --- what is kept -------------------------------------------------------------------------------------------


def _read(path: Path) -> bytes:
    """What `_keep` has written; nothing where there is no file, or it is damaged, or may be somebody else's."""
    try:
        data = read_kept(path)
    except OSError:
        return b""
    return data[DIGEST:] if hashlib.sha256(data[DIGEST:]).digest() == data[:DIGEST] else b""


def _keep(path: Path, code: bytes) -> None:
    """Writes a digest and machine code."""
    try:
        write_atomically(path, hashlib.sha256(code).digest() + code)
        trim()
    except (Sdf2vecError, OSError):
        _warn_once(cache_folder())


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
