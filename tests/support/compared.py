"""Texts and numbers compared with those that were recorded, up to what other processors round otherwise."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from femflex.arrays import Array

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w])")
RULE = re.compile(r"[─━]+")
ROWS = 4  # of each table that follows time: the first, the last, and some between them


def words_of(text: str) -> list[str]:
    """The words of a text, however its lines are folded and its columns are wide."""
    return [word for word in text.split() if not RULE.fullmatch(word)]


def same_words(found: str, wanted: str) -> str:
    """Empty where two texts say the same, their numbers to the last digit but one; else the first difference."""
    a, b = words_of(found), words_of(wanted)
    for k, (one, other) in enumerate(zip(a, b, strict=False)):
        if one != other and not _close(one, other):
            return f"{' '.join(a[max(k - 8, 0) : k + 4])!r}, expected {' '.join(b[max(k - 8, 0) : k + 4])!r}"
    return "" if len(a) == len(b) else f"{len(a)} words, expected {len(b)}: {a[len(b) :][:9]} {b[len(a) :][:9]}"


def _close(one: str, other: str) -> bool:
    """Whether two words are the same but for numbers, which differ by two units of the last digit, by 1e-6 of them, or
    are rounding."""
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    for x, y in zip(NUMBER.findall(one), NUMBER.findall(other), strict=True):
        size = max(abs(float(x)), abs(float(y)))
        step = max(2.1 * max(_last_digit(x), _last_digit(y)), 1e-6 * size)
        if abs(float(x) - float(y)) > step and size > 1e-9:
            return False
    return True


def _last_digit(number: str) -> float:
    digits, _, power = number.partition("e")
    return float(10.0 ** (int(power or 0) - len(digits.partition(".")[2])))


def differing(found: Mapping[str, Array], wanted: Mapping[str, Array], part: float = 1e-6) -> list[str]:
    """Names of numbers that differ by more than a part of the largest of their name or of 1e-6 in SI units."""
    wrong = [f"{name}: in one alone" for name in sorted(set(found) ^ set(wanted))]
    for name in sorted(set(found) & set(wanted)):
        a, b = (np.asarray(one[name], float) for one in (found, wanted))
        if a.shape != b.shape:
            wrong.append(f"{name}: shape {a.shape}, expected {b.shape}")
            continue
        gap, size = (np.abs(np.nan_to_num(one)).max(initial=0.0) for one in (a - b, b))
        if not np.array_equal(np.isnan(a), np.isnan(b)):
            wrong.append(f"{name}: other numbers are missing")
        elif gap > part * size + 1e-3 * part:
            wrong.append(f"{name}: {gap:.2g} off, of {size:.3g}")
    return wrong


def some_rows(numbers: Mapping[str, Array]) -> dict[str, Array]:
    """Rows of each table, those that are recorded, as one list of numbers each."""
    return {name: one[np.linspace(0, len(one) - 1, ROWS).astype(int)].ravel() for name, one in numbers.items()}


def listed(values: Array) -> str:
    """Numbers as they are recorded."""
    return "[" + ", ".join("NaN" if np.isnan(value) else f"{value:.9g}" for value in values) + "]"
