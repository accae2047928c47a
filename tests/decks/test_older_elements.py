"""Elements of NASTRAN-95 give the structure of those that took their place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.nastran_decks import frequencies, read

MAT1 = "MAT1,1,7.E10,,.3,2700."
GRIDS = [f"GRID,{k + 1 + 10 * j},,{0.25 * k},{0.2 * j},0." for j in (0, 1) for k in range(5)]
QUADS = [(k + 1, k + 2, k + 12, k + 11) for k in range(4)]
TRIANGLES = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]
HELD = "SPC1,1,123456,1,11"
BRICKS = [
    f"GRID,{k + 1 + 10 * j + 100 * i},,{0.25 * k},{0.1 * j},{0.1 * i}" for i in (0, 1) for j in (0, 1) for k in range(5)
]
CORNERS = [(k + 1, k + 2, k + 12, k + 11, k + 101, k + 102, k + 112, k + 111) for k in range(4)]


def elements(name: str, pid: int, cells: list[tuple[int, ...]]) -> list[str]:
    cards = []
    for k, nodes in enumerate(cells):
        words = [name, str(k + 1), str(pid), *map(str, nodes)]
        cards.append(",".join(words[:9]))
        if len(words) > 9:
            cards.append("," + ",".join(words[9:]))
    return cards


@pytest.mark.parametrize(
    ("older", "newer"),
    [
        (
            [*elements("CQUAD2", 3, QUADS), "PQUAD2,3,1,.004,1.5"],
            [*elements("CQUAD4", 3, QUADS), "PSHELL,3,1,.004,1,,,,1.5"],
        ),
        (
            [*elements("CTRIA2", 3, TRIANGLES), "PTRIA2,3,1,.004"],
            [*elements("CTRIA3", 3, TRIANGLES), "PSHELL,3,1,.004,1"],
        ),
        (
            [*elements("CQUAD1", 3, QUADS), "PQUAD1,3,1,.004,1,1.6E-8,1,.002"],
            [*elements("CQUAD4", 3, QUADS), "PSHELL,3,1,.004,1,3.,1,.5"],
        ),
    ],
)
def test_plates_of_the_1970s_are_shells(tmp_path: Path, older, newer):
    found = [frequencies(read(tmp_path, *GRIDS, MAT1, HELD, *cards)) for cards in (older, newer)]
    assert found[0] == pytest.approx(found[1], rel=1e-12) and found[0][0] > 1.0


@pytest.mark.parametrize("name", ["CHEXA1", "CHEXA2"])
def test_bricks_name_their_material(tmp_path: Path, name):
    held = "SPC1,1,123,1,11,101,111"
    older = read(tmp_path, *BRICKS, *elements(name, 1, CORNERS), MAT1, held)
    newer = read(tmp_path, *BRICKS, *elements("CHEXA", 5, CORNERS), "PSOLID,5,1", MAT1, held)
    assert frequencies(older) == pytest.approx(frequencies(newer), rel=1e-12)
    assert any(f"4 {name} are read as CHEXA" in note for note in older.notes)


def test_rigid_elements_of_the_1970s_carry_their_grids(tmp_path: Path):
    bar = ["CBAR,90,9,5,20,0.,0.,1.", "PBAR,9,1,1.E-3,1.E-6,1.E-6,1.E-6", "GRID,20,,1.5,0.,0.", "GRID,21,,1.5,.1,0."]
    base = [*GRIDS, *elements("CQUAD4", 3, QUADS), "PSHELL,3,1,.004,1", MAT1, HELD, *bar, "CONM2,91,21,,2."]
    found = [frequencies(read(tmp_path, *base, card)) for card in ("CRIGD1,7,20,21", "RBE2,7,20,123456,21")]
    found.append(frequencies(read(tmp_path, *base, "CRIGD2,7,20,21,123456")))
    assert found[0] == pytest.approx(found[1], rel=1e-12) and found[2] == pytest.approx(found[1], rel=1e-12)
    assert np.all(found[0] > 0)


def test_congruence_needs_nothing_and_a_plate_without_thickness_is_refused(tmp_path: Path):
    cards = [*GRIDS, *elements("CQUAD2", 3, QUADS), "PQUAD2,3,1,.004", MAT1, HELD, "CNGRNT,1,2,3,4"]
    assert not any("CNGRNT" in one.card for one in read(tmp_path, *cards).unused)
    with pytest.raises(ValueError, match=r"PQUAD1 3 has no membrane thickness T1"):
        read(tmp_path, *GRIDS, *elements("CQUAD1", 3, QUADS), "PQUAD1,3,,,1,1.6E-8", MAT1, HELD)
