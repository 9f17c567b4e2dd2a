"""Compilation of the kernels: on import of their module, for stated types, into numba's cache on disk.

Stated types keep a kernel from being compiled again in mid-stream, for an array with another layout or one that is
read-only. Kernels that call each other stand in one folder: numba compares the time and the size of a kernel's own
file, and would not notice a change in another one. Helpers in `dloftbs.kernels.shared` may be called from everywhere.
The digest of both folders is a part of a kernel's stamp.
"""

from __future__ import annotations

import functools
import gc
import hashlib
import logging
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

from numba import njit, types
from numba.core.dispatcher import Dispatcher
from numba.core.typing.templates import infer_global

from dloftbs.kernels.helper_code import HelperCompiler
from dloftbs.kernels.kernel_cache import KernelCache

_Function = TypeVar("_Function", bound=Callable[..., object])

_log = logging.getLogger("dloftbs.kernels")
_helpers: list[Dispatcher] = []


def read(scalar: types.Type, ndim: int, layout: str = "A") -> types.Array:
    """Return the type of an array that is only read: any strides, or C order where `layout` is "C"."""
    return types.Array(scalar, ndim, layout, readonly=True)


def write(scalar: types.Type, ndim: int, layout: str = "A") -> types.Array:
    """Return the type of an array that is written."""
    return types.Array(scalar, ndim, layout)


def kernel(*signature: types.Type | tuple[types.Type, ...]) -> Callable[[_Function], _Function]:
    """Compile a function for these argument types now, or load it from the cache; it releases the GIL while it runs.

    A tuple stands for each of its types.
    """
    signatures = list(product(*(given if isinstance(given, tuple) else (given,) for given in signature)))

    def decorate(function: _Function) -> _Function:
        compiled = njit(nogil=True, no_cfunc_wrapper=True)(function)
        if isinstance(compiled, Dispatcher):  # not where compilation is turned off
            _keep(compiled)
            with _no_collection():
                for one in signatures:
                    compiled.compile(one)
            compiled.disable_compile()
            _count.add(missed=bool(compiled.stats.cache_misses))
        return compiled

    return decorate


def helper(function: _Function) -> _Function:
    """Leave a function to Python as it is, and compile it as a part of the kernels that call it.

    It gets no entry from Python or C: these would take more time to compile than many a helper does.
    """
    return _as_part(function, forceinline=False)


def inlined(function: _Function) -> _Function:
    """Make a helper that is compiled into each place that calls it, as for the body of a loop over words.

    Only what stands in the loop itself can be done to several words at once, and a call counts references.
    """
    return _as_part(function, forceinline=True)


def _as_part(function: _Function, *, forceinline: bool) -> _Function:
    options = {"forceinline": forceinline, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    compiled = njit(pipeline_class=HelperCompiler, **options)(function)
    if isinstance(compiled, Dispatcher):  # not where compilation is turned off
        # What `register_jitable` does compiles a helper again for each kind of caller.
        infer_global(function, types.Dispatcher(compiled))
        _helpers.append(compiled)  # the type holds it by a weak reference alone
    return function


def _keep(compiled: Any) -> None:
    """Keep a kernel on disk; a change in its folder, or of the shared helpers, is a reason to compile it again."""
    compiled._cache = KernelCache(compiled.py_func)
    file = compiled._cache._cache_file
    own = Path(compiled.py_func.__code__.co_filename).parent
    file._source_stamp = (file._source_stamp, folder_digest(own), folder_digest(Path(__file__).parent / "shared"))


@functools.cache
def folder_digest(folder: Path) -> str:
    """Return the digest of a folder of kernels, as their stamps have it."""
    return hashlib.sha256(b"".join(file.read_bytes() for file in sorted(folder.glob("*.py")))).hexdigest()


@functools.cache
def kernel_count() -> int:
    """Return the number of kernels of the package, by the decorators in its files."""
    package = Path(__file__).parents[1]
    files = (file.read_text(encoding="utf-8") for file in package.glob("**/kernels/**/*.py"))
    return sum(len(re.findall(r"^@kernel\(", text, re.MULTILINE)) for text in files)


class _Count:
    """Counts the kernels that are ready, and logs their number once one had to be compiled."""

    def __init__(self) -> None:
        self._ready = 0
        self._announced = False

    def add(self, *, missed: bool) -> None:
        """Count a kernel that was compiled (missed in the cache) or loaded."""
        self._ready += 1
        if missed and not self._announced:
            self._announced = True
            _log.warning(
                "compiling up to %d kernels, once for this machine and version; this takes one to three minutes",
                kernel_count(),
            )
        if self._announced:
            _log.info("kernels ready: %d of %d", self._ready, kernel_count())


_count = _Count()


@contextmanager
def _no_collection() -> Iterator[None]:
    """Suspend the collection of garbage, which takes a twentieth of the time, with little to find."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()
