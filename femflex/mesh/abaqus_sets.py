"""Named sets of nodes or elements of an Abaqus deck, by instance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from femflex.mesh.numbers import Numbers

Parts = list[int | range]
Key = tuple[str, str]  # instance and set, in capitals; "" is the deck or the assembly itself


class Sets:
    """Numbers by instance and set name; Abaqus does not distinguish capitals from small letters.

    kind    NSET or ELSET
    shifts  what is added to the numbers of an instance, by its name in capitals
    """

    def __init__(self, kind: str, shifts: Mapping[str, int]) -> None:
        self.kind = kind
        self._shifts = shifts
        self._parts: dict[Key, Parts] = {}
        self._spelling: dict[Key, str] = {}

    def add(self, scope: str, name: str, numbers: Sequence[int | range]) -> None:
        """Add numbers and ranges to a set, new or known; a name of "" is none."""
        if name:
            key = scope.upper(), name.upper()
            self._spelling.setdefault(key, name)
            self._parts.setdefault(key, []).extend(numbers)

    def knows(self, word: str, scope: str) -> bool:
        """Whether a word is a number, or the name of a known set, as seen from an instance."""
        return word.lstrip("-").isdigit() or self._key(word, scope) is not None or self._numbered(word) is not None

    def named(self, word: str, scope: str, place: str = "") -> Parts:
        """Numbers and ranges of a set, or of one number: 12, SET, INSTANCE.12 or INSTANCE.SET.

        Raises ValueError on an unknown set, with the known ones.
        """
        if word.lstrip("-").isdigit():
            return [int(word) + self._shifts.get(scope.upper(), 0)]
        key = self._key(word, scope)
        if key is not None:
            return list(self._parts[key])
        number = self._numbered(word)
        if number is not None:
            return [number]
        known = sorted({self._spelling[key] for key in self._parts})
        shown = f"{known[:30]} and {len(known) - 30} more" if len(known) > 30 else str(known)
        raise ValueError(
            f"{place}{': ' if place else ''}{self.kind} {word!r} is used but not defined; known are {shown}. "
            "Correct the name, or add the set."
        )

    def members(self) -> dict[str, Numbers]:
        """Numbers of every set by the name of its group.

        That is the set's own name where one instance alone has sets, else INSTANCE.SET.
        """
        scopes = {scope for scope, _ in self._parts if scope}
        plain = {name for scope, name in self._parts if not scope}
        found: dict[str, Numbers] = {}
        for (scope, name), parts in self._parts.items():
            alone = not scope or (len(scopes) == 1 and len(self._shifts) <= 2 and name not in plain)
            spelled = self._spelling[scope, name]
            found[spelled if alone else f"{self._spelled(scope)}.{spelled}"] = Numbers(tuple(parts))
        return found

    def spell_instance(self, name: str) -> None:
        """Remember how an instance is written."""
        self._spelling.setdefault((name.upper(), ""), name)

    def _spelled(self, scope: str) -> str:
        return self._spelling.get((scope, ""), scope)

    def _key(self, word: str, scope: str) -> Key | None:
        name = word.upper()
        own = scope.upper(), name
        if own in self._parts:
            return own
        if ("", name) in self._parts:
            return "", name
        instance, dot, rest = name.partition(".")
        if dot and (instance, rest) in self._parts:
            return instance, rest
        if dot and ("", rest) in self._parts and instance not in self._shifts:
            return "", rest  # PART.SET in a flat deck
        holders = [key for key in self._parts if key[1] == name]
        return holders[0] if len(holders) == 1 else None

    def _numbered(self, word: str) -> int | None:
        instance, _, rest = word.upper().rpartition(".")
        return int(rest) + self._shifts[instance] if rest.isdigit() and instance in self._shifts else None
