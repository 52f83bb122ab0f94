"""The threads that kernels run in: how many, the pool of them, and torch's own out of their way."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from typing import Any, TypeVar

import torch

from .limits import THREADS, whole_number

T = TypeVar("T")
R = TypeVar("R")


@contextmanager
def threads_of_its_own() -> Iterator[None]:
    """Torch on one thread meanwhile: its waiting threads would spin on the cores that the kernels need."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def in_threads(function: Callable[..., object], *arguments: Any, most: int | None = None) -> None:
    """Runs function(first, step, …) in every thread, which is to take each step-th piece of work, of `most` at most."""
    count = threads() if most is None else min(threads(), most)
    in_threads_each(lambda first: function(first, count, *arguments), range(count))


def in_threads_each(function: Callable[[T], R], items: Sequence[T]) -> list[R]:
    """The function's results for all items: every thread takes its share, this one, which need not be woken, too."""
    count = min(threads(), len(items))
    if count < 2:
        return list(map(function, items))
    shares = [items[first::count] for first in range(count)]
    pool = _pool(threads() - 1)
    others = [pool.submit(_each, function, share) for share in shares[1:]]
    found = [_each(function, shares[0]), *(other.result() for other in others)]
    return [found[index % count][index // count] for index in range(len(items))]


def _each(function: Callable[[T], R], items: Sequence[T]) -> list[R]:
    return list(map(function, items))


def threads() -> int:
    """How many threads there are: `$SDF2VEC_THREADS`, or one for each core that this process may use.

    Raises Sdf2vecError where that is no number of threads.
    """
    return whole_number("SDF2VEC_THREADS", available_cores(), THREADS)


@cache
def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, thread_name_prefix="sdf2vec")
