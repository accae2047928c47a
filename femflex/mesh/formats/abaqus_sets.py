"""Named sets of nodes or elements of an Abaqus deck, by instance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from femflex.mesh.formats.numbers import Numbers

Parts = list[int | range]
Key = tuple[str, str]  # instance and set, in capitals; "" is the deck or the assembly itself


class Sets:
    """Numbers by instance and set name; Abaqus does not distinguish capitals from small letters.

    kind    NSET or ELSET
    shifts  offset added to the numbers of an instance, by its name in capitals
    """

    def __init__(self, kind: str, shifts: Mapping[str, int]) -> None:
        self.kind = kind
        self._shifts = shifts
        self._parts: dict[Key, Parts] = {}
        self._spelling: dict[Key, str] = {}

    def add(self, scope: str, name: str, numbers: Sequence[int | range]) -> None:
        """Add numbers and ranges to a set, which is created if needed; nothing is added if the name is ""."""
        if name:
            key = scope.upper(), name.upper()
            self._spelling.setdefault(key, name)
            self._parts.setdefault(key, []).extend(numbers)

    def is_known(self, word: str, scope: str) -> bool:
        """Whether a word is a number, or the name of a known set, when used in an instance."""
        return (
            word.lstrip("-").isdigit() or self._key(word, scope) is not None or self._instance_number(word) is not None
        )

    def numbers_in(self, word: str, scope: str, location: str = "") -> Parts:
        """Numbers and ranges of a set, or of one number: 12, SET, INSTANCE.12 or INSTANCE.SET.

        Raises ValueError on an unknown set, with the known ones.
        """
        if word.lstrip("-").isdigit():
            return [int(word) + self._shifts.get(scope.upper(), 0)]
        key = self._key(word, scope)
        if key is not None:
            return list(self._parts[key])
        number = self._instance_number(word)
        if number is not None:
            return [number]
        names = sorted({self._spelling[key] for key in self._parts})
        names_text = f"{names[:30]} and {len(names) - 30} more" if len(names) > 30 else str(names)
        raise ValueError(
            f"{location}{': ' if location else ''}{self.kind} {word!r} is used but not defined; known are "
            f"{names_text}. Correct the name, or add the set."
        )

    def members(self) -> dict[str, Numbers]:
        """Numbers of every set by the name of its group.

        The name is that of the set if only one instance has sets, otherwise INSTANCE.SET.
        """
        scopes = {scope for scope, _ in self._parts if scope}
        global_names = {name for scope, name in self._parts if not scope}
        groups: dict[str, Numbers] = {}
        for (scope, name), parts in self._parts.items():
            unambiguous = not scope or (len(scopes) == 1 and len(self._shifts) <= 2 and name not in global_names)
            spelling = self._spelling[scope, name]
            groups[spelling if unambiguous else f"{self._spelled(scope)}.{spelling}"] = Numbers(tuple(parts))
        return groups

    def spell_instance(self, name: str) -> None:
        """Store the spelling of the name of an instance."""
        self._spelling.setdefault((name.upper(), ""), name)

    def _spelled(self, scope: str) -> str:
        return self._spelling.get((scope, ""), scope)

    def _key(self, word: str, scope: str) -> Key | None:
        name = word.upper()
        scoped_key = scope.upper(), name
        if scoped_key in self._parts:
            return scoped_key
        if ("", name) in self._parts:
            return "", name
        instance, dot, set_name = name.partition(".")
        if dot and (instance, set_name) in self._parts:
            return instance, set_name
        if dot and ("", set_name) in self._parts and instance not in self._shifts:
            return "", set_name  # PART.SET in a flat deck
        holders = [key for key in self._parts if key[1] == name]
        return holders[0] if len(holders) == 1 else None

    def _instance_number(self, word: str) -> int | None:
        instance, _, number = word.upper().rpartition(".")
        return int(number) + self._shifts[instance] if number.isdigit() and instance in self._shifts else None
