"""Warnings about physics, as data from which their text is made, and about the folder for compiled code."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Any

NAMED = 3  # further bodies whose names a line lists


class PhysicsWarning(UserWarning):
    """A model is outside the range of its assumptions.

    body_or_joint  the body, joint or group of a mesh that it is about; empty for the whole craft
    effect         what happens, in words that are the same for all bodies; fields in braces stand for the values below:
                   "{body_or_joint} extends over {value:.4g} m, below {limit:g} m."
    value, limit   the computed value, and what it is compared with, in the same unit; None where there is no number
    remedy         what to do
    further        other values that `effect` and `remedy` name

    The text is effect and remedy with the values filled in, or `text` if it is passed. A warning with `effect` alone
    has no data.
    """

    def __init__(
        self,
        effect: str,
        *,
        body_or_joint: str = "",
        value: object = None,
        limit: object = None,
        remedy: str = "",
        text: str = "",
        **further: object,
    ) -> None:
        self.body_or_joint, self.effect, self.value, self.limit, self.remedy = (
            body_or_joint,
            effect,
            value,
            limit,
            remedy,
        )
        if not text:
            text = f"{effect} {remedy}".rstrip()
            if body_or_joint or value is not None or further:
                text = text.format(body_or_joint=body_or_joint, value=value, limit=limit, **further)
        super().__init__(text)


def warn_of_physics(effect: str, **data: Any) -> None:
    """Issue a `PhysicsWarning` of that effect and these data, as of the caller of the function that warns."""
    warnings.warn(PhysicsWarning(effect, **data), stacklevel=3)


class TruncationWarning(PhysicsWarning):
    """The bodies retain too few shapes for the craft's lowest frequencies."""


class CacheWarning(UserWarning):
    """Compiled code cannot be stored, so it is compiled again in every process."""


def grouped_texts(issued: Iterable[Warning]) -> list[str]:
    """One line per effect: the text for the first body, and the names of the others that have the same effect.

    >>> bent = "{body_or_joint}: bent by {value} %."
    >>> grouped_texts([PhysicsWarning(bent, body_or_joint=name, value=2) for name in "abc"] + [UserWarning("other")])
    ['a: bent by 2 %. (likewise b, c, each with its own numbers)', 'other']
    """
    kinds: dict[object, dict[str, str]] = {}  # effect -> body -> text
    for warning in issued:
        text = str(warning)
        if not isinstance(warning, PhysicsWarning) or not warning.body_or_joint:
            kinds.setdefault(text, {}).setdefault("", text)
            continue
        texts = kinds.setdefault((type(warning), warning.effect, warning.remedy), {})
        if texts.setdefault(warning.body_or_joint, text) != text:  # twice of one body: a line of its own
            kinds.setdefault(text, {})[""] = text
    lines = []
    for texts in kinds.values():
        (_, first_text), *further = texts.items()
        names = [name for name, _ in further]
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        note = "with its own numbers" if len(names) == 1 else "each with its own numbers"
        lines.append(first_text + (f" (likewise {', '.join(names[:NAMED])}{more}, {note})" if names else ""))
    return lines
