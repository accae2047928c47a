"""What is made once while the bodies of a case are built, and kept until they all are: structures, and bodies.

Bodies are built several times where their strain is left to choice, or where their joints call for more shapes. Each
structure is assembled once, and what is computed of it is kept (`Structure.recalled`). A body whose table has come to
say the same again is not reduced again; its warnings are given every time.
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
    """Structures by what they are made of, and bodies by what their case says, each with the warnings given of it."""

    structures: dict[str, tuple[Structure, list[Warning]]] = field(default_factory=dict)
    parts: dict[str, tuple[Any, list[Warning]]] = field(default_factory=dict)

    def structure(self, key: str, make: Callable[[], Structure]) -> Structure:
        """The structure of this key, made when it is first wanted."""
        return _once(self.structures, key, make)

    def part(self, key: str, make: Callable[[], T]) -> T:
        """The body of this key, made when it is first wanted."""
        return _once(self.parts, key, make)


def _once(made: dict[str, tuple[T, list[Warning]]], key: str, make: Callable[[], T]) -> T:
    if key not in made:
        with warnings.catch_warnings(record=True) as given:
            warnings.simplefilter("always")
            found = make()
        made[key] = found, [_warning(one.message) for one in given]
    found, messages = made[key]
    for message in messages:
        warnings.warn(message, stacklevel=4)
    return found


def _warning(message: Warning | str) -> Warning:
    return message if isinstance(message, Warning) else UserWarning(message)


_SHARED: ContextVar[SharedParts | None] = ContextVar("shared", default=None)


def shared_parts() -> SharedParts | None:
    """What is shared at present."""
    return _SHARED.get()


@contextmanager
def shared_structures() -> Iterator[None]:
    """While this lasts, structures and bodies are made once; then all that is known of the structures is dropped."""
    if _SHARED.get() is not None:
        yield
        return
    made = SharedParts()
    token = _SHARED.set(made)
    try:
        yield
    finally:
        _SHARED.reset(token)
        for structure, _ in made.structures.values():
            structure.forget()
