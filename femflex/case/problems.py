"""Problems of a case file: each one sentence with file, key path, what was found, what is known and what to do."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Problem:
    """One thing wrong in a case file, at a key path such as `bodies.panel.mass`."""

    where: str
    text: str

    def __str__(self) -> str:
        return printable(f"{self.where}: {self.text}" if self.where else self.text)


class CaseError(ValueError):
    """A case that cannot be run, with all problems found together."""

    def __init__(self, file: str, problems: Sequence[Problem]) -> None:
        self.file, self.problems = file, tuple(problems)
        super().__init__("\n".join(f"{file}: {problem}" for problem in self.problems))


def printable(text: str) -> str:
    """The text in one line: words of more than 120 characters cut, control characters written as escapes.

    >>> printable("found 'a\\x00b'")
    "found 'a\\\\x00b'"
    """
    cut = re.sub(r"\S{121,}", lambda word: f"{word[0][:60]}...{word[0][-20:]}", text)
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in cut)


FEW = 4  # known names that are listed even where one of them is near


def near(name: str, known: Iterable[str]) -> str:
    """Part of a sentence: "did you mean 'mass'?" when a known name is near; the known names otherwise, or if few.

    >>> near("mas", ["mass", "inertia"]), near("x", ["a", "b"])
    ("did you mean 'mass'? known are 'inertia', 'mass'", "known are 'a', 'b'")
    """
    names, name = sorted(known), name[:100]
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if not close:
        folded = {n.lower(): n for n in names}
        close = [folded[name.lower()]] if name.lower() in folded else []
    known = f"known are {listed(names)}" if names else "there are none"
    if close:
        return f"did you mean {close[0]!r}?" + (f" {known}" if 1 < len(names) <= FEW else "")
    return known


def listed(names: Iterable[str]) -> str:
    """Names in quotes with commas."""
    return ", ".join(repr(name) for name in names)


def item_label(items: Any, index: int) -> str:
    """How an entry of an array of tables is called: its name, its child, or its number."""
    item = items[index] if isinstance(items, list) and index < len(items) else None
    if isinstance(item, dict):
        for key in ("name", "child", "group"):
            if isinstance(item.get(key), str) and item[key]:
                same = sum(1 for other in items if isinstance(other, dict) and other.get(key) == item[key])
                return str(item[key]) if same == 1 else f"{index}: {item[key]}"
    return str(index)
