"""Compilation of the kernels: on first use, for stated types, into a cache on disk.

Stated types keep a kernel from being compiled again in mid-stream, for an array with another layout or one that is
read-only. Kernels that call each other stand in one folder, and helpers in `dloftbs.kernels.shared` may be called from
everywhere: the digest of both folders is the stamp by which the cache knows what is outdated.
"""

from __future__ import annotations

import functools
import gc
import hashlib
import logging
import threading
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from time import monotonic
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from numba import njit, types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher
from numba.core.typing.templates import infer_global

from dloftbs.kernels.helper_code import HelperCompiler
from dloftbs.kernels.kernel_cache import KernelCache

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Bytes = npt.NDArray[np.uint8]
Words = npt.NDArray[np.uint64]

_Function = TypeVar("_Function", bound=Callable[..., object])

_log = logging.getLogger("dloftbs.kernels.progress")
_SHARED = Path(__file__).parent / "shared"
LINE_EVERY_S = 5.0
"""Seconds from one line about the compilation to the next."""
_kernels: list[_Kernel] = []
_waiting_helpers: deque[tuple[Callable[..., object], bool]] = deque()
_helpers: list[Dispatcher] = []


def read(scalar: types.Type, ndim: int, layout: str = "A") -> types.Array:
    """Return the type of an array that is only read: any strides, or C order where `layout` is "C"."""
    return types.Array(scalar, ndim, layout, readonly=True)


def write(scalar: types.Type, ndim: int, layout: str = "A") -> types.Array:
    """Return the type of an array that is written."""
    return types.Array(scalar, ndim, layout)


def kernel(*signature: types.Type | tuple[types.Type, ...]) -> Callable[[_Function], _Function]:
    """Compile a function for these argument types when it is first called; it releases the GIL while it runs.

    A tuple stands for each of its types.
    """
    signatures = list(product(*(given if isinstance(given, tuple) else (given,) for given in signature)))

    def decorate(function: _Function) -> _Function:
        compiled = njit(nogil=True, no_cfunc_wrapper=True)(function)
        if isinstance(compiled, Dispatcher):  # not where compilation is turned off
            _kernels.append(_Kernel(compiled, signatures))
        return compiled

    return decorate


class _Kernel:
    """A kernel, and the types that it is compiled for."""

    def __init__(self, dispatcher: Any, signatures: Sequence[tuple[types.Type, ...]]) -> None:
        function = dispatcher.py_func
        self.module = str(function.__module__)
        self._dispatcher = dispatcher
        self._signatures = signatures
        file = Path(function.__code__.co_filename)
        sources = (_file_digest(file), folder_digest(file.parent), folder_digest(_SHARED))
        dispatcher._cache = KernelCache(function, _digest("".join(sources).encode()), _before_compilation)
        # Numba asks these two before a kernel is first called, from Python and from another kernel.
        dispatcher._compile_for_args = self._before_call
        dispatcher.get_call_template = self._before_link

    def is_in(self, room: str) -> bool:
        """Return whether the kernel stands in a room, or in a module of one."""
        return f"{self.module}.".startswith(f"dloftbs.{room}.")

    def is_cached(self) -> bool:
        """Return whether the cache has a file for each of the types."""
        made = self._dispatcher
        return all(made._cache.holds(one, made.targetctx) for one in self._signatures)

    def can_save(self) -> bool:
        """Return whether the cache takes new files."""
        return bool(self._dispatcher._cache.can_save())

    def make_ready(self) -> None:
        """Load the kernel from the cache, or compile it, once."""
        made = self._dispatcher
        with global_compiler_lock, _no_collection():
            if not made._can_compile:
                return
            for one in self._signatures:
                made.compile(one)
            made.disable_compile()
            del made._compile_for_args, made.get_call_template
        if made.stats.cache_misses:
            progress.add()

    def _before_call(self, *_arguments: object, **_named: object) -> Any:
        """Return a function for numba to call with the same arguments."""
        self.make_ready()
        return self._dispatcher

    def _before_link(self, *types_given: Any) -> Any:
        self.make_ready()
        return self._dispatcher.get_call_template(*types_given)


def count_missing(rooms: Sequence[str] | None = None) -> dict[str, int]:
    """Count the imported kernels that are not in the cache, by module, in the order of the rooms; of all rooms if None.

    A room is a folder of the package, or one of its modules with kernels, such as ``"linking.kernels.pair_costs"``.

    Where nothing can be saved nothing is gained by compiling in other processes: then there are none.
    """
    missing = dict[str, int]()
    for one in _kernels if rooms is None else [one for room in rooms for one in _kernels if one.is_in(room)]:
        if not one.is_cached():
            if not one.can_save():
                return {}
            missing[one.module] = missing.get(one.module, 0) + 1
    return missing


def make_ready(rooms: Collection[str] | None = None, modules: Collection[str] | None = None) -> None:
    """Load or compile the imported kernels, all of them or those of some rooms or modules."""
    for one in _kernels:
        if (rooms is None or any(map(one.is_in, rooms))) and (modules is None or one.module in modules):
            one.make_ready()


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
    _waiting_helpers.append((function, forceinline))
    return function


def install_helpers() -> None:
    """Let numba know the helpers, which takes time that kernels from the cache do not need."""
    while _waiting_helpers:
        function, forceinline = _waiting_helpers.popleft()
        options = {"forceinline": forceinline, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        compiled = njit(pipeline_class=HelperCompiler, **options)(function)
        if isinstance(compiled, Dispatcher):  # not where compilation is turned off
            # What `register_jitable` does compiles a helper again for each kind of caller.
            infer_global(function, types.Dispatcher(compiled))
            _helpers.append(compiled)  # the type holds it by a weak reference alone


@functools.cache
def folder_digest(folder: Path) -> str:
    """Return the digest of a folder of kernels, as their stamps have it."""
    return _digest(b"".join(file.read_bytes() for file in sorted(folder.glob("*.py"))))


@functools.cache
def _file_digest(file: Path) -> str:
    return _digest(file.read_bytes())


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


class Progress:
    """Logs a warning when a kernel has to be compiled, and every few seconds how many are."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._count = 0
        self._since = self._due = 0.0

    def begin(self) -> None:
        """Announce the compilation, once."""
        with self._lock:
            if not self._since:
                self._since = monotonic()
                self._due = self._since + LINE_EVERY_S
                _log.warning(
                    "compiling kernels, once for this machine and version; this takes half a minute to two minutes "
                    "(`dloftbs warmup` compiles all in advance)"
                )

    def add(self, count: int = 1) -> None:
        """Count kernels that were compiled."""
        with self._lock:
            self._count += count
            now = monotonic()
            if now >= self._due:
                self._due = now + LINE_EVERY_S
                _log.warning("%d kernels compiled in %.0f s", self._count, now - self._since)


def _before_compilation() -> None:
    install_helpers()
    progress.begin()


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


progress = Progress()
