"""Elements that hold the reference node of a distributing coupling are used, and not told as left out."""

from __future__ import annotations

from pathlib import Path

from test_deck_abaqus import beam, deck

from femflex.decks.report import describe

BEAM = beam("RECT", "10., 20.\n0., 1., 0.")
COUPLING = (
    "*NODE\n900, 2000., 300., 0.\n*ELEMENT, TYPE=DCOUP3D, ELSET=SPREAD\n900, 900\n"
    "*DISTRIBUTING COUPLING, ELSET=SPREAD\n"
)


def test_the_element_of_a_distributing_coupling_is_not_told_as_left_out(tmp_path: Path):
    with_coupling = deck(tmp_path, BEAM + COUPLING + "1, 1.\n2, 1.\n3, 2.\n")
    assert len(with_coupling.connections) == 1
    assert with_coupling.unused == ()
    heat = "*NODE\n901, 0., 0., 9.\n902, 9., 0., 9.\n*ELEMENT, TYPE=DC1D2, ELSET=HEAT\n901, 901, 902\n"
    assert "1 elements DC1D2: elements of heat or acoustics are left out" in describe(deck(tmp_path, BEAM + heat))
