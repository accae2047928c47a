"""Options of member families: name, meaning, unit and default of each."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from femflex.fem.structure import Member


@dataclass(frozen=True)
class Option:
    """One option of a family of members.

    default  its value when left out
    meaning  in words, for the README and the schema
    unit     SI unit of its numbers ("" for plain ones); None for a word, a whole number or a truth value
    shapes   how many numbers it may take: 0 for one alone
    field    whether it may be a formula of x, y and z in place of numbers
    """

    default: Any
    meaning: str
    unit: str | None = None
    shapes: tuple[int, ...] = (0,)
    field: bool = False


Options = Mapping[str, Option]
OPTIONS: dict[str, Options] = {}  # by family, filled where a family is registered


def member_options(member: Member) -> dict[str, Any]:
    """The member's options over the defaults of its family.

    Raises ValueError for an option that the family does not have, with the most similar name.
    """
    options = OPTIONS[member.family]
    for name in member.options:
        if name not in options:
            close = difflib.get_close_matches(name, list(options), n=1)
            hint = f" Did you mean {close[0]!r}?" if close else ""
            raise ValueError(
                f"{member.family} on group {member.group!r} has no option {name!r}; its options are "
                f"{sorted(options)}.{hint}"
            )
    return {**{name: option.default for name, option in options.items()}, **member.options}
