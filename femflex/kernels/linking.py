"""Compilation of kernels and their parts to machine code: every part once, inside the kernels that use it.

By default Numba optimises and emits every function by itself, and again inside each of its callers, up to the kernel.
That takes most of the time of a first compilation. A part shared by two kernels is then bound to the copy that was
emitted first, so a process that compiles rounds differently from later ones that load. Here a part is only translated.
A kernel links private copies of its parts and is optimised as a whole, so it computes the same in every process. Steps
of Numba that do nothing for parts are left out: half of the time of translating is spent on analysis between steps.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numba.core.codegen
import numba.core.compiler
from llvmlite.binding import Linkage

Library: Any = numba.core.codegen.JITCodeLibrary  # numba's own annotations do not cover these
SHORT = 20  # instructions up to which a function may be inlined in its callers
LEFT_OUT = {  # steps for what parts do not have: closures, context managers, sums of arrays
    "WithLifting",
    "InlineClosureLikes",
    "RewriteSemanticConstants",
    "DeadBranchPrune",
    "RewriteDynamicRaises",
    "MakeFunctionToJitFunction",
    "InlineInlinables",
    "FindLiterallyCalls",
    "LiteralUnroll",
    "LiteralPropagationSubPipelinePass",
    "InlineOverloads",
    "NopythonRewrites",
    "NoPythonSupportedFeatureValidation",
    "AnnotateTypes",
    "DumpParforDiagnostics",
}
Compiler: Any = numba.core.compiler.Compiler


class _Unbound:
    """Code generator whose functions are never called from Python, and so have no environment to set."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing: there is no environment."""


class _PartLibrary(Library):  # type: ignore[misc]
    """Library of a part: its function alone, which kernels link with those that it calls, optimise and emit."""

    @property
    def codegen(self) -> Any:
        return _Unbound(self._codegen)

    def get_pointer_to_function(self, name: str) -> int:
        return 0

    def add_llvm_module(self, ll_module: Any) -> None:
        self._optimize_functions(ll_module)
        self._final_module = ll_module

    def finalize(self) -> None:
        self._finalized = True


class _KernelLibrary(Library):  # type: ignore[misc]
    """Library of a kernel with private copies of its parts.

    Their names must not be visible outside: the linker would bind other code to them, although their arguments are no
    longer passed as declared.
    """

    def finalize(self) -> None:
        for library in self._linking_libraries:  # grows while it is read, to all that are called at any depth
            if isinstance(library, _PartLibrary):
                self._linking_libraries += [n for n in library._linking_libraries if n not in self._linking_libraries]
        super().finalize()

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                function.linkage = "private"
        super()._optimize_final_module()


class _LoopLibrary(_KernelLibrary):
    """Library of an integrator's loop, whose parts are not inlined: their time is small beside that of the model.

    Inlining would give seven times the code, and the compiler would take three times as long.
    """

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                if sum(1 for block in function.blocks for _ in block.instructions) > SHORT:
                    function.add_function_attribute("noinline")
        super()._optimize_final_module()


class PartCompiler(Compiler):  # type: ignore[misc]
    """Pipeline of a function that only other compiled functions call."""

    def define_pipelines(self) -> Any:
        self.state.library = _PartLibrary(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        managers = super().define_pipelines()
        for manager in managers:
            manager.passes = [step for step in manager.passes if step[0].__name__ not in LEFT_OUT]
        return managers


class KernelCompiler(Compiler):  # type: ignore[misc]
    """Pipeline of a kernel that is stored on disk."""

    library: ClassVar[Any] = _KernelLibrary

    def define_pipelines(self) -> Any:
        self.state.library = self.library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        return super().define_pipelines()


class LoopCompiler(KernelCompiler):
    """Pipeline of the loop of an integrator."""

    library = _LoopLibrary
