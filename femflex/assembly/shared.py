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


Entries = list[tuple[Any, Any, list[Warning]]]  # inputs, what was built from them, and the warnings then


@dataclass(frozen=True, eq=False)
class SharedParts:
    """Structures and bodies with their inputs, each with the warnings issued when it was built."""

    structures: Entries = field(default_factory=list)
    parts: Entries = field(default_factory=list)

    def structure(self, inputs: object, make: Callable[[], Structure]) -> Structure:
        """The structure of these inputs, built by `make` at the first request."""
        return _build_once(self.structures, inputs, make)

    def body(self, inputs: object, make: Callable[[], T]) -> T:
        """The body of these inputs, built by `make` at the first request."""
        return _build_once(self.parts, inputs, make)


def _build_once(entries: Entries, inputs: object, make: Callable[[], T]) -> T:
    if all(known != inputs for known, *_ in entries):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            built = make()
        given = (warning.message for warning in caught)
        entries.append((inputs, built, [text if isinstance(text, Warning) else UserWarning(text) for text in given]))
    part: T
    _, part, messages = next(entry for entry in entries if entry[0] == inputs)
    for message in messages:
        warnings.warn(message, stacklevel=4)
    return part


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
        for _, structure, _ in shared.structures:
            structure.forget()
