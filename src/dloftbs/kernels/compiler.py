"""Compilation of the kernels: on import of their module, for stated types, into numba's cache on disk.

Stated types keep a kernel from being compiled again in mid-stream, for an array with another layout or one that is
read-only. Kernels that call each other stand in one folder: numba compares the time and the size of a kernel's own
file, and would not notice a change in another one. Helpers in `dloftbs.kernels.shared` may be called from everywhere.
The digest of both folders is a part of a kernel's stamp.
"""

from __future__ import annotations

import functools
import hashlib
import logging
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

from numba import njit, types
from numba.extending import register_jitable

_Function = TypeVar("_Function", bound=Callable[..., object])

_log = logging.getLogger("dloftbs.kernels")


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
        compiled = njit(nogil=True)(function)
        if hasattr(compiled, "enable_caching"):  # not where compilation is turned off
            compiled.enable_caching()
            _stamp(compiled)
            for one in signatures:
                compiled.compile(one)
            compiled.disable_compile()
        statistics = getattr(compiled, "stats", None)  # absent where compilation is turned off
        if statistics is not None and statistics.cache_misses:
            _announce()
        return compiled

    return decorate


def helper(function: _Function) -> _Function:
    """Compile a function as a part of the kernels that call it."""
    return njit(nogil=True)(function)


def inlined(function: _Function) -> _Function:
    """Compile a function into each place that calls it, as for the body of a loop over words.

    Only what stands in the loop itself can be done to several words at once, and a call counts references.
    """
    return njit(nogil=True, forceinline=True)(function)


def shared(function: _Function) -> _Function:
    """Leave a function to Python as it is, and compile it into each kernel that calls it."""
    register_jitable(forceinline=True)(function)
    return function


def _stamp(compiled: Any) -> None:
    """Make a change in the kernel's folder, or of the shared helpers, a reason to compile it again."""
    file = compiled._cache._cache_file
    own = Path(compiled.py_func.__code__.co_filename).parent
    file._source_stamp = (file._source_stamp, folder_digest(own), folder_digest(Path(__file__).parent / "shared"))


@functools.cache
def folder_digest(folder: Path) -> str:
    """Return the digest of a folder of kernels, as their stamps have it."""
    return hashlib.sha256(b"".join(file.read_bytes() for file in sorted(folder.glob("*.py")))).hexdigest()


@functools.cache
def _announce() -> None:
    _log.warning("compiling the kernels, once for this machine and version; this takes a minute or two")
