"""Warnings: about physics, as data from which their text is made, and about the place for compiled code."""

from __future__ import annotations

from collections.abc import Iterable

NAMED = 3  # further bodies that a line on several of them names


class PhysicsWarning(UserWarning):
    """A model is outside what its assumptions cover.

    body_or_joint  the body, joint or group of a mesh that it is about; empty for the whole craft
    effect         what happens, in words that are the same for all bodies; fields in braces stand for the values below:
                   "{body_or_joint} extends over {value:.4g} m, below {limit:g} m."
    value, limit   the computed value, and what it is compared with, in the same unit; None where there is no number
    remedy         what to do
    further        other values that `effect` and `remedy` name

    The text is effect and remedy with the values put in, or `text` where that is given. A warning of `effect` alone is
    a text without data.
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


class TruncationWarning(PhysicsWarning):
    """The sets of shapes that bodies keep are too small for the craft's lowest frequencies."""


class CacheWarning(UserWarning):
    """Compiled code cannot be stored, so it is compiled again in every process."""


def grouped_texts(given: Iterable[Warning]) -> list[str]:
    """One line per effect: the text for the first body, and the names of the others that have the same effect.

    >>> bent = "{body_or_joint}: bent by {value} %."
    >>> grouped_texts([PhysicsWarning(bent, body_or_joint=name, value=2) for name in "abc"] + [UserWarning("other")])
    ['a: bent by 2 %. (likewise b, c, each with its own numbers)', 'other']
    """
    kinds: dict[object, dict[str, str]] = {}  # effect -> body -> text
    for one in given:
        text = str(one)
        if not isinstance(one, PhysicsWarning) or not one.body_or_joint:
            kinds.setdefault(text, {}).setdefault("", text)
            continue
        texts = kinds.setdefault((type(one), one.effect, one.remedy), {})
        if texts.setdefault(one.body_or_joint, text) != text:  # twice of one body: a line of its own
            kinds.setdefault(text, {})[""] = text
    lines = []
    for texts in kinds.values():
        (_, first), *others = texts.items()
        names = [name for name, _ in others]
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        own = "with its own numbers" if len(names) == 1 else "each with its own numbers"
        lines.append(first + (f" (likewise {', '.join(names[:NAMED])}{more}, {own})" if names else ""))
    return lines
