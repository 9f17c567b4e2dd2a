"""Compilation of helpers only as far as the kernels that call them need it.

By itself numba optimises each helper on its own and makes machine code of it, which nobody calls: a kernel takes in
what LLVM has of its helpers, optimises that as a whole, and makes machine code of its own. To leave this out saves a
tenth of all compilation. It overrides methods that numba keeps to itself; where a version of numba does not call these,
helpers are compiled in full again.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering


class HelperCompiler(CompilerBase):  # type: ignore[misc]  # numba has no types
    """The passes of numba, but for the last one."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes in their order."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [(_Lowering if one is NativeLowering else one, about) for one, about in passes.passes]
        passes.finalize()
        return [passes]


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):  # type: ignore[misc]  # numba has no types
    """Lowers a helper to code that is there to be linked."""

    _name = "dloftbs_helper_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _LinkedCode(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().run_pass(state)


class _LinkedCode(JITCodeLibrary):  # type: ignore[misc]  # numba has no types
    """Code of a helper, of which there is no machine code."""

    def _optimize_final_module(self) -> None:
        """Leave it to the kernel."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return that there is no such function."""
        return 0

    @property
    def codegen(self) -> _LinkedCode:
        """Itself, which is handed the helper's environment."""
        return self

    def set_env(self, env_name: str, env: object) -> None:
        """Ignore the environment, which only code with Python objects reads."""
