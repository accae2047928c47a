"""Inertias at grids that rods and rigid elements share: whatever rigid element it is, they are left out and told."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.nastran_decks import bar, frequencies, read

from femflex.decks.report import describe

ROD = ["GRID,20,,2.,0.5,0.", "GRID,21,,0.,0.5,0.", "CONROD,30,20,21,1,1.-5", "SPC1,1,123,21"]
INERTIA = ["CONM2,40,20,,2.", ",0.1,,0.2,,,0.3"]
RIGID = {
    "RBE2": ["RBE2,7,9,123456,20"],
    "RBAR": ["RBAR,7,9,20,123456"],
    "RBE1": ["RBE1,7,9,123456", ",UM,20,123456"],
}


@pytest.mark.parametrize("element", RIGID)
def test_an_inertia_at_the_end_of_a_rod_is_left_out_by_every_rigid_element(tmp_path: Path, element: str):
    deck = read(tmp_path, *bar(8), *ROD, *INERTIA, *RIGID[element])
    told = [f"{one}" for one in deck.unused]
    assert len(told) == 1
    assert "1 CONM2 inertia: its grid has no rotation (solids, rods): its mass acts at the grid" in told[0]
    assert "stops" not in describe(deck)
    plain = read(tmp_path, *bar(8), *ROD, INERTIA[0], *RIGID["RBE2"])
    assert frequencies(deck) == pytest.approx(frequencies(plain), rel=1e-9)
