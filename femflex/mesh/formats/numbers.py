"""Lists of numbers in decks, such as 1, 3, 7 to 40000 by 2; ranges are stored as ranges and not expanded."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass


def inclusive_range(first: int, last: int, step: int = 1) -> range:
    """The numbers from the first to the last, both included; a negative step runs down.

    >>> list(inclusive_range(4, 1, -1))
    [4, 3, 2, 1]

    Raises ValueError for a step that does not lead from the first to the last.
    """
    if step == 0 or (last - first) * step < 0:
        raise ValueError(f"a step of {step} does not lead from {first} to {last}; correct the step or the two numbers")
    return range(first, last + (1 if step > 0 else -1), step)


@dataclass(frozen=True)
class Numbers:
    """Numbers and ranges in the order listed, without those in `without`."""

    parts: tuple[int | range, ...] = ()
    without: Numbers | None = None

    def among(self, allowed: Collection[int]) -> list[int]:
        """The numbers that are in `allowed` (a dict or a set), in order.

        A range longer than `allowed` is not iterated over; the allowed numbers in it are sorted instead.
        """
        members: list[int] = []
        for part in self.parts:
            if isinstance(part, int):
                members += [part] if part in allowed else []
            elif len(part) <= len(allowed):
                members += [number for number in part if number in allowed]
            else:
                members += sorted((number for number in allowed if number in part), reverse=part.step < 0)
        excluded = set(self.without.among(allowed)) if self.without is not None else set()
        return [number for number in members if number not in excluded] if excluded else members

    def all_in(self, allowed: Collection[int]) -> bool:
        """Whether all numbers are in `allowed`."""
        for part in self.parts:
            if isinstance(part, int):
                if part not in allowed and not self._is_excluded(part):
                    return False
            # ends at the first unknown
            elif not all(number in allowed or self._is_excluded(number) for number in part):
                return False
        return True

    def _is_excluded(self, number: int) -> bool:
        parts = self.without.parts if self.without is not None else ()
        return any(number == part if isinstance(part, int) else number in part for part in parts)
