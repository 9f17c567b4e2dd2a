"""Compiled kernels on disk: a file each, written at once or not at all, and read only if it is whole.

Numba's own cache needs a folder that it can write, and fails on a damaged file. This one also reads from folders that
cannot be written, takes a file that it cannot read for a missing one, and goes on without a file that it cannot save.
It overrides methods that numba keeps to itself, as do the classes of `helper_code`.
"""

from __future__ import annotations

import hashlib
import inspect
import logging
import pickle
import sys
import uuid
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from llvmlite import binding
from numba.core.caching import _Cache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from dloftbs.kernels.cache_places import can_write, list_places

_log = logging.getLogger("dloftbs.kernels")

_SUM_BYTES = 4
"""Length of the checksum at the start of a file."""
_VERSION = (numba.__version__, sys.implementation.cache_tag)
_IS_KNOWN = hasattr(JITCodeLibrary, "_get_module_for_linking")
"""True for versions of numba whose way to link one kernel into another is the one that is overridden here."""


class KernelCache(_Cache):  # type: ignore[misc]  # numba has no types
    """The cache of a kernel.

    Parameters
    ----------
    function : callable
        The kernel before compilation.
    stamp : str
        Digest of all sources that its code depends on.
    on_miss : callable
        Called where a kernel has to be compiled.
    """

    def __init__(self, function: Callable[..., object], stamp: str, on_miss: Callable[[], None]) -> None:
        file = Path(inspect.getfile(function))
        self._name = f"{file.stem}.{function.__qualname__}".replace("<", "").replace(">", "")
        self._stamp = stamp
        self._folder = file.parent
        self._on_miss = on_miss

    @property
    def cache_path(self) -> str:
        """Preferred folder."""
        return str(list_places(self._folder)[0])

    def holds(self, signature: Any, target_context: Any) -> bool:
        """Return whether there is a file for a signature, readable or not."""
        name = self._file_name(signature, target_context.codegen())
        return any((place / name).is_file() for place in list_places(self._folder))

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """Return the kernel compiled for a signature, or None where no file of it can be read."""
        target_context.refresh()
        name = self._file_name(signature, target_context.codegen())
        for place in list_places(self._folder):
            stored = _read(place / name)
            if stored is not None:
                return _rebuild(target_context, pickle.loads(stored))
        self._on_miss()
        return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Save a compiled kernel in the first folder that takes it, in the place of those of earlier sources."""
        name = self._file_name(signature, compiled.codegen)
        stored = dumps(compiled._reduce())
        reasons = set()
        for place in list_places(self._folder):
            try:
                _write(place / name, stored)
            except OSError as error:
                reasons.add(error.strerror or str(error))
            else:
                _remove_older(place / name)
                return
        _warn_unsaved(", ".join(sorted(reasons)))

    def can_save(self) -> bool:
        """Return whether one of the folders takes files."""
        return any(can_write(place) for place in list_places(self._folder))

    def enable(self) -> None:
        """Do nothing: the cache is always on."""

    def disable(self) -> None:
        """Do nothing, likewise."""

    def flush(self) -> None:
        """Do nothing: what is outdated has another name."""

    def _file_name(self, signature: Any, codegen: Any) -> str:
        variant = _digest(repr((str(signature), codegen.magic_tuple(), _VERSION)).encode())
        return f"{self._name}-{variant}-{self._stamp[:16]}.nbc"


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


def _read(path: Path) -> bytes | None:
    """Return what a file holds, or None if it cannot be read or is damaged."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    stored = data[_SUM_BYTES:]
    return stored if stored and data[:_SUM_BYTES] == _checksum(stored) else None


def _write(path: Path, stored: bytes) -> None:
    """Write a file under another name, then give it its own, so that no process ever reads a part of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f"{path.name}.{uuid.uuid4().hex[:16]}")
    try:
        draft.write_bytes(_checksum(stored) + stored)
        draft.replace(path)
    except OSError:
        draft.unlink(missing_ok=True)
        raise


def _checksum(stored: bytes) -> bytes:
    return zlib.crc32(stored).to_bytes(_SUM_BYTES, "little")


def _remove_older(path: Path) -> None:
    """Remove the files of the same kernel and variant that were compiled from earlier sources."""
    variant = path.name.rpartition("-")[0]
    for other in path.parent.glob(f"{variant}-*.nbc"):
        if other != path:
            try:
                other.unlink(missing_ok=True)
            except OSError as error:
                _log.info("an outdated kernel stays: %s", error)


@cache
def _warn_unsaved(why: str) -> None:
    """Warn once for each reason."""
    _log.warning(
        "compiled kernels cannot be saved, so that the next start compiles them again (%s); "
        "set NUMBA_CACHE_DIR to a folder that can be written",
        why,
    )


def _rebuild(target_context: Any, payload: Any) -> Any:
    """Return a compiled kernel from its stored form: its machine code, and LLVM's code only when it is linked.

    By itself numba parses all of LLVM's code at once, in case another function that is yet to be compiled links it:
    half the time of loading, for nothing where all kernels are compiled. What a version of numba stores in another
    form, or links by another method, is loaded as numba does.
    """
    match payload:
        case ((name, "object", (bytes() as machine_code, bytes() as code)), described, *rest) if _IS_KNOWN:
            entry = _name_alone(described.llvm_cpython_wrapper_name)
            loaded = CompileResult._rebuild(target_context, (name, "object", (machine_code, entry)), described, *rest)
            loaded.library._get_module_for_linking = cache(lambda: binding.parse_bitcode(code))
            return loaded
    return CompileResult._rebuild(target_context, *payload)


def _name_alone(function: str) -> bytes:
    """Return LLVM's code of a function that does nothing: numba asks for the name before it asks where the function is.

    The function itself is in the machine code.
    """
    code: bytes = binding.parse_assembly(f'define void @"{function}"() {{\n  ret void\n}}').as_bitcode()
    return code
