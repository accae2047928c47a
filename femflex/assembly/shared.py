"""Structures and bodies that are shared while the bodies of a case are built.

Bodies are built several times if their strain is selected automatically, or if joints require more shapes. Each
structure is assembled once, and quantities computed from it are kept (`Structure.recalled`). A body whose table is
unchanged is not reduced again; its warnings are issued every time.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any, TypeVar

from femflex.fem import Structure

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class SharedParts:
    """Structures and bodies by keys made of their tables, each with the warnings issued when it was built."""

    structures: dict[str, tuple[Structure, list[Warning]]] = field(default_factory=dict)
    parts: dict[str, tuple[Any, list[Warning]]] = field(default_factory=dict)

    def structure(self, key: str, make: Callable[[], Structure]) -> Structure:
        """The structure of this key, built by `make` at the first request."""
        return _build_once(self.structures, key, make)

    def body(self, key: str, make: Callable[[], T]) -> T:
        """The body of this key, built by `make` at the first request."""
        return _build_once(self.parts, key, make)


def _build_once(parts: dict[str, tuple[T, list[Warning]]], key: str, make: Callable[[], T]) -> T:
    if key not in parts:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            part = make()
        parts[key] = part, [_as_warning(warning.message) for warning in caught]
    part, messages = parts[key]
    for message in messages:
        warnings.warn(message, stacklevel=4)
    return part


def _as_warning(message: Warning | str) -> Warning:
    return message if isinstance(message, Warning) else UserWarning(message)


_SHARED: ContextVar[SharedParts | None] = ContextVar("shared", default=None)


def shared_parts() -> SharedParts | None:
    """The structures and bodies shared at present; None outside of `shared_structures`."""
    return _SHARED.get()


@contextmanager
def shared_structures() -> Iterator[None]:
    """Build structures and bodies once within this context; at its end the cached data of structures is dropped."""
    if _SHARED.get() is not None:
        yield
        return
    shared = SharedParts()
    token = _SHARED.set(shared)
    try:
        yield
    finally:
        _SHARED.reset(token)
        for structure, _ in shared.structures.values():
            structure.forget()
