"""Problems of a case file: each is one sentence with file, key path, what was found, what is known and what to do."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
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
    """A case that cannot be run, with all of its problems."""

    def __init__(self, file: str, problems: Sequence[Problem]) -> None:
        self.file, self.problems = file, tuple(problems)
        super().__init__("\n".join(f"{file}: {problem}" for problem in self.problems))


def printable(text: str) -> str:
    """The text in one line: words of more than 120 characters cut, control characters written as escapes, and its
    lines separated by semicolons.

    >>> printable("found 'a\\x00b'"), printable("a.bdf cannot be used:\\n  line 5\\n  line 7")
    ("found 'a\\\\x00b'", 'a.bdf cannot be used: line 5; line 7')
    """
    text = re.sub(r"\s*\n\s*", "; ", re.sub(r":\s*\n\s*", ": ", text.strip("\n")))
    cut = re.sub(r"\S{121,}", lambda word: f"{word[0][:60]}...{word[0][-20:]}", text)
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in cut)


FEW = 4  # known names that are listed even where one of them is close


def suggestion_text(name: str, candidates: Iterable[str]) -> str:
    """Part of a sentence: "did you mean 'mass'?" if a candidate is close; else, or if they are few, the candidates.

    >>> suggestion_text("mas", ["mass", "inertia"]), suggestion_text("x", ["a", "b"])
    ("did you mean 'mass'? known are 'inertia', 'mass'", "known are 'a', 'b'")
    """
    names, name = sorted(candidates), name[:100]
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if not close:
        folded = {n.lower(): n for n in names}
        close = [folded[name.lower()]] if name.lower() in folded else []
    candidates = f"known are {quoted_names(names)}" if names else "there are none"
    if close:
        return f"did you mean {close[0]!r}?" + (f" {candidates}" if 1 < len(names) <= FEW else "")
    return candidates


def unknown_name(where: str, name: str | None, known: Collection[str], what: str = "not a body") -> Iterator[Problem]:
    """The problem of a name that is not among the known ones; none where there is no name."""
    if name is not None and name not in known:
        yield Problem(where, f"found {name!r}, which is {what}; {suggestion_text(name, known)}")


def quoted_names(names: Iterable[str]) -> str:
    """Names in quotes, separated by commas."""
    return ", ".join(repr(name) for name in names)


def item_label(items: Any, index: int) -> str:
    """Label of an entry of an array of tables: its name, its child, or its number."""
    item = items[index] if isinstance(items, list) and index < len(items) else None
    if isinstance(item, dict):
        for key in ("name", "child", "group"):
            if isinstance(item.get(key), str) and item[key]:
                namesakes = sum(1 for entry in items if isinstance(entry, dict) and entry.get(key) == item[key])
                return str(item[key]) if namesakes == 1 else f"{index}: {item[key]}"
    return str(index)
