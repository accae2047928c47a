"""Loads, stores and addresses in code being compiled: by opaque pointers where llvmlite has them, else typed ones."""

from __future__ import annotations

import inspect
from typing import Any

import llvmlite.ir

ir: Any = llvmlite.ir  # not annotated throughout

OPAQUE = "typ" in inspect.signature(ir.IRBuilder.load).parameters and getattr(ir.PointerType, "is_opaque", False)


def pointer_to(kind: Any) -> Any:
    """LLVM type of a pointer to numbers of that type."""
    return ir.PointerType() if OPAQUE else kind.as_pointer()


def address(builder: Any, pointer: Any, i: Any, kind: Any) -> Any:
    """Address of entry i behind a pointer to that type."""
    return builder.gep(pointer, [i], source_etype=kind) if OPAQUE else builder.gep(pointer, [i])


def load(builder: Any, pointer: Any, kind: Any, align: int | None = None) -> Any:
    """The value of that type at a pointer."""
    if OPAQUE:
        return builder.load(pointer, typ=kind, align=align)
    return builder.load(builder.bitcast(pointer, kind.as_pointer()), align=align)


def store(builder: Any, value: Any, pointer: Any, align: int | None = None) -> None:
    """Write a value at a pointer; llvmlite checks the type behind it, but prints an opaque pointer."""
    builder.store(value, builder.bitcast(pointer, value.type.as_pointer()), align=align)
