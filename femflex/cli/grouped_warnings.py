"""Warnings on standard error: each once, and those that say the same of several bodies as one line."""

from __future__ import annotations

import re
import sys
import warnings
from typing import Any

NUMBER = re.compile(r"(?<![A-Za-z_])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
GROUP = re.compile(r"\bgroup '([^']*)'")
NAMED = 3  # names of further bodies or groups that are listed


class WarningGroups:
    """Warnings that wait until the work in hand is done, so that those of one kind can be reported together."""

    def __init__(self) -> None:
        self._texts: dict[str, None] = {}
        self._waiting: list[str] = []

    def add(self, text: str) -> None:
        """Take up a warning, unless it was reported already."""
        if text not in self._texts:
            self._texts[text] = None
            self._waiting.append(text)

    @property
    def texts(self) -> list[str]:
        """All of them, in the order in which they came."""
        return list(self._texts)

    def print_pending(self) -> None:
        """Print what waits."""
        waiting, self._waiting = self._waiting, []
        for line in grouped(waiting):
            print(f"femflex: warning: {line}", file=sys.stderr)


GATHERED = WarningGroups()


def gather_warnings() -> None:
    """Have the warnings of femflex gathered from here on, and others dropped."""
    global GATHERED
    from femflex.warning import CacheWarning, PhysicsWarning

    gathered = GATHERED = WarningGroups()

    def show(message: Warning | str, category: type[Warning], *_: Any) -> None:
        if issubclass(category, CacheWarning | PhysicsWarning):
            gathered.add(str(message))

    warnings.simplefilter("ignore")
    warnings.simplefilter("always", PhysicsWarning)
    warnings.simplefilter("always", CacheWarning)
    warnings.showwarning = show  # type: ignore[assignment]


def warnings_so_far() -> list[str]:
    """The warnings of this command so far, those that say the same of several bodies as one."""
    return grouped(GATHERED.texts)


def print_warnings() -> None:
    """Print the warnings that wait."""
    GATHERED.print_pending()


def grouped(texts: list[str]) -> list[str]:
    """One line per kind of warning: those that differ in numbers alone, and in the body they begin with or in the group
    they name.

    >>> grouped(["a: off by 2 %", "b: off by 3 %", "other"])
    ['a: off by 2 % (likewise b, with its own numbers)', 'other']
    >>> grouped(["a: plate on group 'skin' is thick", "a: plate on group 'rib' is thick"])
    ["a: plate on group 'skin' is thick (likewise 'rib', with its own numbers)"]
    """
    kinds: dict[str, list[tuple[str, str, str]]] = {}  # body, group, text
    for text in texts:
        name, colon, rest = text.partition(": ")
        named = bool(colon) and " " not in name
        name, rest = (name, rest) if named else ("", text)
        group = GROUP.search(rest)
        kind = text
        if named or group:
            plain = GROUP.sub("group NAME", rest)
            plain = re.sub(rf"\b{re.escape(name)}\b", "NAME", plain) if named else plain
            kind = "# " + NUMBER.sub("#", plain)
        kinds.setdefault(kind, []).append((name, group[1] if group else "", text))
    out = []
    for members in kinds.values():
        first, *rest_of = members
        own_body = all(name == first[0] for name, _, _ in rest_of)
        others = list(dict.fromkeys(f"'{group}'" if own_body and group else name for name, group, _ in rest_of))
        more = f" and {len(others) - NAMED} more" if len(others) > NAMED else ""
        own = "with its own numbers" if len(others) == 1 else "each with its own numbers"
        out.append(first[2] + (f" (likewise {', '.join(others[:NAMED])}{more}, {own})" if others else ""))
    return out
