"""Facts of decks for a starting case: units, mass, supports, ends, frequencies and what needs to be looked at."""

from __future__ import annotations

import numpy as np
import pytest

import femflex.assembly.deck_facts as module
from femflex.assembly.deck_facts import deck_facts

# A bar of 1.2 m along (0.6, 0.8, 0) in millimetres and tonnes, node 30 at its start and node 11 at its end.
BULK = """SOL 103
CEND
{control}
BEGIN BULK
GRID,30,,100.,50.,20.
GRID,7,,340.,370.,20.
GRID,9,,580.,690.,20.
GRID,11,,820.,1010.,20.
CBAR,1,4,30,7,0.,0.,1.
CBAR,2,4,7,9,0.,0.,1.
{last}
PBAR,4,6,120.,4000.,900.,1500.
MAT1,6,70000.,,.3,{density}
{more}
ENDDATA
"""
LAST = "CBAR,3,4,9,11,0.,0.,1."
AREA, WEAK, STRONG, LENGTH, E, RHO = 120e-6, 900e-12, 4000e-12, 1.2, 70e9, 2700.0
MASS = RHO * AREA * LENGTH


@pytest.fixture
def facts(tmp_path):
    def read(units="mm-t-s", control="", more="", density="2.7-9", last=LAST):
        path = tmp_path / "bar.bdf"
        path.write_text(BULK.format(control=control, more=more, density=density, last=last))
        return deck_facts(path, units, "decks/bar.bdf")

    return read


def bending(factor: float, inertia: float) -> float:
    return factor**2 * np.sqrt(E * inertia / (RHO * AREA * LENGTH**4)) / (2 * np.pi)


CLAMPED, FREE = 1.87510406871196, 4.73004074486270
HELD = "SPC1,7,123456,30\nSPC1,8,123,11"
FREE_NOTE = "reduction: {} all rigid-body motions of the deck; its modes are free-free"


def test_a_bar_with_its_supports_in_force_has_the_frequencies_of_a_cantilever(facts):
    found = facts(control="SPC = 7", more=HELD)
    assert (found.file, found.solver, found.units, found.units_reason) == (
        "decks/bar.bdf",
        "Nastran",
        "mm-t-s",
        "as stated",
    )
    assert found.supports == ("spc_7", "spc_8") and found.clamp == "supports"
    assert (found.root, found.tip) == (30, 11)
    assert found.mass == pytest.approx(MASS, rel=1e-9) and found.extent == pytest.approx(0.96)
    assert len(found.frequencies) == 6
    assert found.frequencies[:2] == pytest.approx([bending(CLAMPED, WEAK), bending(CLAMPED, STRONG)], rel=2e-3)
    assert found.materials == ("mat_6",) and found.weightless == () and found.notes == ()
    assert found.groups == ("pid_4", "spc_7", "spc_8")  # neither nodes, nor parts, nor what a support holds


def test_the_first_set_that_holds_the_bar_clamps_it_where_none_is_in_force(facts):
    found = facts(more="SPC1,5,123,11\nSPC1,7,123456,11\nSPC1,8,123456,30")
    assert (found.clamp, found.root, found.tip) == ("spc_7", 11, 30)
    assert found.supports == ("spc_5", "spc_7", "spc_8") and found.notes == ()
    assert facts(more="SPC1,7,123456,11\nSPC1,8,123456,30").clamp == "spc_7"


def test_a_bar_that_nothing_holds_is_free_and_its_nodes_are_those_about_its_centre(facts):
    heavy = "CONM2,50,9,,1.0-3"
    found = facts(more=heavy)
    assert found.clamp == "" and found.supports == () and found.notes == (FREE_NOTE.format("no supports restrain"),)
    assert (found.root, found.tip) == (9, 30) and found.mass == pytest.approx(MASS + 1.0)
    bare = facts()
    assert bare.frequencies[:2] == pytest.approx([bending(FREE, WEAK), bending(FREE, STRONG)], rel=1e-2)
    part = facts(more="SPC1,7,123,11\nSPC1,9,12,30")
    assert part.notes == (FREE_NOTE.format("none of its sets of supports (spc_7, spc_9) restrains"),)
    assert part.clamp == "" and part.supports == ("spc_7", "spc_9")


def test_units_that_are_not_given_are_those_in_which_its_numbers_are_usual(facts):
    found = facts(None, control="SPC = 7", more=HELD)
    why = "a guess: in these E is 70 GPa, a density of 2700 kg/m^3, and it spans 0.96 m"
    assert (found.units, found.units_reason) == ("mm-t-s", why)
    assert found.notes == (f"units: mm-t-s is {why}; state the deck's own with --units",)
    assert found.mass == pytest.approx(MASS) and found.extent == pytest.approx(0.96)
    assert found.frequencies[0] == pytest.approx(bending(CLAMPED, WEAK), rel=2e-3)


def test_a_deck_without_mass_gets_the_density_of_aluminium_for_all_its_materials(facts):
    found = facts(control="SPC = 7", more=HELD + "\nMAT1,3,60000.,,.3", density="")
    assert found.weightless == found.materials and set(found.weightless) == {"mat_6", "mat_3"}
    names = ", ".join(found.weightless)
    assert found.notes == (f"overrides: the deck has no mass; a density of 2700 kg/m^3 of {names} is a guess",)
    assert found.mass == pytest.approx(MASS) and found.frequencies[0] == pytest.approx(bending(CLAMPED, WEAK), rel=2e-3)


def test_a_deck_of_one_mass_on_a_massless_bar_has_three_modes(facts):
    """A mass m at the end: EA / L, and 3 EI / L^3 about both axes; what has no mass has no frequency."""
    found = facts(control="SPC = 7", more=HELD + "\nCONM2,50,11,,2.0-3", density="0.")
    assert found.mass == pytest.approx(2.0) and found.weightless == ()
    stiffness = np.array([3 * E * WEAK / LENGTH**3, 3 * E * STRONG / LENGTH**3, E * AREA / LENGTH])
    assert found.frequencies == pytest.approx(np.sqrt(stiffness / 2.0) / (2 * np.pi), rel=1e-6)


def test_large_decks_and_mechanisms_have_no_frequencies_and_say_so(facts, monkeypatch):
    apart = facts(last="GRID,40,,0.,0.,500.\nGRID,41,,0.,300.,500.\nCBAR,3,4,40,41,0.,0.,1.")
    assert apart.frequencies == () and len(apart.notes) == 2
    assert apart.notes[1].startswith("modes: ") and "\n" not in apart.notes[1]
    monkeypatch.setattr(module, "LARGEST", 39)  # 6 of each node, and 5 inside each bar
    assert len(facts(control="SPC = 7", more=HELD).frequencies) == 6
    monkeypatch.setattr(module, "LARGEST", 38)
    found = facts(control="SPC = 7", more=HELD)
    assert found.frequencies == () and found.mass == pytest.approx(MASS)
    assert found.notes == ("run: duration and torque are guesses (39 degrees of freedom, modes not computed)",)
