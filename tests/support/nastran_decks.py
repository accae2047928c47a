"""Small Nastran decks for tests: a cantilever by cards, written to a folder and read."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femflex.decks import Deck, read_deck
from femflex.reduction import cantilever_modes

STEEL = "MAT1,1,2.1E11,,0.3,7850."


def written(folder: Path, *cards: str, control: str = "SPC = 1", name: str = "deck.bdf") -> Path:
    """A deck of these cards."""
    path = folder / name
    path.write_text("\n".join(["SOL 103", "CEND", control, "BEGIN BULK", *cards, "ENDDATA", ""]), encoding="utf-8")
    return path


def read_deck_of_cards(
    folder: Path, *cards: str, control: str = "SPC = 1", units: str = "m-kg-s", **more: object
) -> Deck:
    """The Deck of these cards."""
    return read_deck(written(folder, *cards, control=control), units, **more)  # type: ignore[arg-type]


def frequencies(deck: Deck, n: int = 4) -> np.ndarray:
    """Lowest natural frequencies [Hz] under the supports in force."""
    return np.asarray(cantilever_modes(deck.structure(), deck.active_supports(), n).omega[:n]) / (2 * np.pi)


def bar(
    n: int = 8, length: float = 2.0, section: str = "PBAR,3,1,1.E-3,2.E-7,8.E-7,1.E-6", line: str = ""
) -> list[str]:
    """A cantilever along x of n CBARs, held at grid 1 by SPC1 1."""
    grids = [f"GRID,{k + 1},,{length * k / n:.6f},0.,0." for k in range(n + 1)]
    bars = [f"CBAR,{k + 1},3,{k + 1},{k + 2},0.,1.,0.{line}" for k in range(n)]
    return [*grids, *bars, section, STEEL, "SPC1,1,123456,1"]


def lines(*words: object) -> list[str]:
    """A card of any length in free fields, eight on a line."""
    name, *rest = words
    return [",".join(map(str, [name if k == 0 else "", *rest[k : k + 8]])) for k in range(0, len(rest), 8)]


def plate(*properties: str, n: int = 4) -> list[str]:
    """A cantilever plate of n by 2 quadrilaterals, 1 m by 0.5 m, held along x = 0."""
    grids = [f"GRID,{1 + i + (n + 1) * j},,{i / n},{j / 4},0." for j in range(3) for i in range(n + 1)]
    firsts = [1 + i + (n + 1) * j for j in range(2) for i in range(n)]
    cells = [f"CQUAD4,{100 + k},3,{a},{a + 1},{a + n + 2},{a + n + 1}" for k, a in enumerate(firsts)]
    return [*grids, *cells, *properties, "SPC1,1,123456," + ",".join(str(1 + (n + 1) * j) for j in range(3))]
