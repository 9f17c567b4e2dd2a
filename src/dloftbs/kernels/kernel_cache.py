"""Loading of compiled kernels: their machine code, and LLVM's code of them only for a kernel that takes them in.

By itself numba parses all that LLVM has of a function when it loads it from the cache, in case another function that is
yet to be compiled takes it in: half the time of loading, for nothing where all kernels are compiled. It overrides
methods that numba keeps to itself; what a version of numba stores in another form, or takes in by another method, is
loaded as numba does.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from llvmlite import binding
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.codegen import JITCodeLibrary

_IS_KNOWN = hasattr(JITCodeLibrary, "_get_module_for_linking")
"""True for versions of numba whose way to take a kernel in is the one that is overridden here."""


class _MachineCodeFirst(CompileResultCacheImpl):  # type: ignore[misc]  # numba has no types
    """Loads a kernel by its machine code."""

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """Return a compiled kernel from what is stored of it."""
        match payload:
            case ((name, "object", (bytes() as machine_code, bytes() as code)), described, *rest) if _IS_KNOWN:
                entry = _name_alone(described.llvm_cpython_wrapper_name)
                loaded = super().rebuild(target_context, ((name, "object", (machine_code, entry)), described, *rest))
                loaded.library._get_module_for_linking = cache(lambda: binding.parse_bitcode(code))
                return loaded
        return super().rebuild(target_context, payload)


class KernelCache(FunctionCache):  # type: ignore[misc]  # numba has no types
    """The cache of a kernel."""

    _impl_class = _MachineCodeFirst


def _name_alone(function: str) -> bytes:
    """Return LLVM's code of a function that does nothing: numba asks for the name before it asks where the function is.

    The function itself is in the machine code.
    """
    code: bytes = binding.parse_assembly(f'define void @"{function}"() {{\n  ret void\n}}').as_bitcode()
    return code
