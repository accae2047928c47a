"""Nastran decks as structures: frequencies against closed forms, masses, systems, connections and springs."""

from __future__ import annotations

import numpy as np
import pytest
from support.nastran_decks import STEEL, bar, frequencies, read, written

from femflex.decks import read_deck
from femflex.decks.findings import Place
from femflex.decks.nastran.card import Card
from femflex.decks.report import describe, mass_and_centre

BETA = 1.8751040687119611  # first root of cos x cosh x = -1
E, RHO = 2.1e11, 7850.0


def euler(EI: float, m: float, L: float) -> float:
    """First frequency of a uniform cantilever [Hz]."""
    return BETA**2 * np.sqrt(EI / (m * L**4)) / (2 * np.pi)


def test_a_cantilever_of_bars_bends_in_both_planes_as_euler_says(tmp_path):
    found = frequencies(read(tmp_path, *bar()), 2)
    wanted = [euler(E * I, RHO * 1e-3, 2.0) for I in (2e-7, 8e-7)]  # I1 bends in plane 1, x-y
    # rotary inertia, which the deck's bars have, takes (beta r / L)^2 / 2 = 2e-4 and 8e-4 of it, up to a factor of 4
    assert found == pytest.approx(wanted, rel=4e-3)
    assert (found < wanted).all()


@pytest.mark.parametrize("units, length, mass", [("mm-t-s", 1e-3, 1e3), ("in-lbf-s", 0.0254, 175.12683524647636)])
def test_a_deck_in_other_units_has_the_same_frequencies(tmp_path, units, length, mass):
    n, force = 8, mass * length
    A, I1, I2, J = (v / length**p for v, p in ((1e-3, 2), (2e-7, 4), (8e-7, 4), (1e-6, 4)))
    cards = bar(n, 2.0 / length, f"PBAR,3,1,{A:.12E},{I1:.12E},{I2:.12E},{J:.12E}")
    cards = [card for card in cards if card != STEEL]
    steel = f"MAT1,1,{E * length**2 / force:.12E},,0.3,{RHO * length**3 / mass:.12E}"
    deck = read(tmp_path, *cards, steel, units=units)
    assert frequencies(deck, 2) == pytest.approx(frequencies(read(tmp_path, *bar()), 2), rel=1e-6)
    assert mass_and_centre(deck.structure())[0] == pytest.approx(RHO * 1e-3 * 2.0, rel=1e-6)


def test_wtmass_scales_densities_and_point_masses(tmp_path):
    cards = ["CONM2,50,9,,3.", "PARAM,WTMASS,0.5"]
    mass, centre = mass_and_centre(read(tmp_path, *bar(), *cards).structure())
    assert mass == pytest.approx((RHO * 1e-3 * 2.0 + 3.0) / 2)
    assert centre[0] == pytest.approx((RHO * 2e-3 * 1.0 + 3.0 * 2.0) / (RHO * 2e-3 + 3.0))


def test_grids_in_nested_and_curved_systems_make_the_same_mast(tmp_path):
    """CORD2C in a CORD2R, and CORD1R on three of the grids; CD turns the axes of the supports and of the bars."""
    systems = [
        "CORD2R,1,0,1.,2.,3.,1.,2.6,3.8", ",2.,2.,3.",
        "CORD2C,2,1,0.,0.,0.,1.,0.,0.", ",0.,0.,1.",  # z along x of system 1, its x axis along z of system 1
    ]  # fmt: skip
    plain = bar()
    cards = [f"GRID,{k + 1},2,0.,0.,{2.0 * k / 8:.6f},1" for k in range(9)]
    cards += [card for card in plain if not card.startswith("GRID")]
    deck = read(tmp_path, *systems, *cards)
    assert deck.mesh.points[8] == pytest.approx([3.0, 2.0, 3.0])
    assert frequencies(deck) == pytest.approx(frequencies(read(tmp_path, *plain)), rel=1e-9)


def test_supports_along_cd_hold_one_direction_askew(tmp_path):
    """A bar held at both ends, free to slide along 45 degrees at one: the slide is that of the CD system."""
    cards = [
        "CORD2R,9,,0.,0.,0.,0.,0.,1.", ",1.,1.,0.",
        *[card for card in bar() if not card.startswith(("SPC1", "GRID,9,"))],
        "GRID,9,,2.,0.,0.,9", "SPC1,1,123456,1", "SPC1,1,23456,9",
    ]  # fmt: skip
    deck = read(tmp_path, *cards)
    structure = deck.structure()
    held = structure.held_dofs(deck.held())
    free = np.setdiff1d(np.arange(structure.n_dof), held)
    moved = structure.translation[24:27].toarray()[:, free]  # grid 9
    directions = moved[:, np.abs(moved).any(axis=0)].T
    assert np.abs(directions) / np.linalg.norm(directions) == pytest.approx(
        np.array([[1, 1, 0]]) / np.sqrt(2), abs=1e-9
    )


def test_offsets_of_bars_raise_their_bending_stiffness_as_the_parallel_axes_say(tmp_path):
    """Two bars on one line of grids, one shifted by 0.1 m on each side: EI = 2 (I + A d^2).

    Between grids the two bend as a frame, which shears by h^2 / 24 EI: 1 / f^2 = 1 / f_EI^2 + (4 L)^2 m h^2 / 24 EI.
    """
    n, d, h = 16, 0.1, 2.0 / 16
    grids = [f"GRID,{k + 1},,{2.0 * k / n:.6f},0.,0." for k in range(n + 1)]
    bars = []
    for k in range(n):
        for side, first in ((d, 1), (-d, 101)):
            bars.append(f"CBAR,{first + k},3,{k + 1},{k + 2},0.,1.,0.\n,,,0.,{side},0.,0.,{side},0.")
    cards = [*grids, *bars, "PBAR,3,1,1.E-3,2.E-7,8.E-7,1.E-6", STEEL, "SPC1,1,123456,1"]
    deck = read(tmp_path, *cards)
    line = euler(2 * E * (2e-7 + 1e-3 * d**2), 2 * RHO * 1e-3, 2.0)
    soft = euler(2 * E * 8e-7, 2 * RHO * 1e-3, 2.0)
    found = frequencies(deck, 4)
    assert np.abs(found - soft).min() < 0.01 * soft
    wanted = (line**-2 + 64.0 * 2 * RHO * 1e-3 * h**2 / (24 * E * 2e-7)) ** -0.5
    assert np.abs(found - wanted).min() < 0.02 * line  # rotary inertia of the two lines, 2 (beta d / L)^2 at most


def test_pins_make_a_hinge(tmp_path):
    """Pinned at both ends by pin flags, clamped grids: a simply supported beam, pi^2 sqrt(EI / m L^4)."""
    cards = [c for c in bar() if not c.startswith(("CBAR,1,", "CBAR,8,", "SPC1"))]
    cards += ["CBAR,1,3,1,2,0.,1.,0.", ",456,", "CBAR,8,3,8,9,0.,1.,0.", ",,56", "SPC1,1,123456,1,9"]
    cards[-4] = ",56,"
    found = frequencies(read(tmp_path, *cards), 1)[0]
    assert found == pytest.approx(np.pi / 2 * np.sqrt(E * 2e-7 / (RHO * 1e-3 * 16.0)), rel=1e-3)


def test_a_truss_of_rods_is_held_where_nothing_resists(tmp_path):
    """Two rods at 45 degrees carry a mass in their plane: omega^2 = EA / (L m) along both axes."""
    cards = [
        "GRID,1,,0.,0.,0.", "GRID,2,,2.,0.,0.", "GRID,3,,1.,1.,0.",
        "CROD,1,7,1,3", "CROD,2,7,2,3", "PROD,7,1,1.E-4", "MAT1,1,2.1E11,,0.3", "CONM2,9,3,,10.",
        "SPC1,1,123,1,2",
    ]  # fmt: skip
    deck = read(tmp_path, *cards)
    assert "autospc" in deck.default_supports
    assert frequencies(deck, 2) == pytest.approx(
        [np.sqrt(2.1e11 * 1e-4 / (np.sqrt(2) * 10.0)) / (2 * np.pi)] * 2, rel=1e-6
    )


def test_masses_on_springs_need_no_elements(tmp_path):
    """Two masses, three scalar springs and a bushing: the 2 x 2 matrix says the frequencies."""
    cards = [
        "GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "CONM2,11,1,,2.", "CONM2,12,2,,3.",
        "CELAS2,1,1000.,1,1", "CELAS2,2,500.,1,1,2,1", "PBUSH,5,K,250.", "CBUSH,3,5,2,,,,,0",
        "SPC1,1,23456,1,2",
    ]  # fmt: skip
    deck = read(tmp_path, *cards)
    K, M = np.array([[1500.0, -500.0], [-500.0, 750.0]]), np.diag([2.0, 3.0])
    wanted = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)) / (2 * np.pi)
    assert frequencies(deck, 2) == pytest.approx(wanted, rel=1e-9)


def test_an_equation_moves_its_first_component_with_the_others(tmp_path):
    """u2 = 3 u1 by MPC: one mass of 2 + 9 * 3 kg on a spring."""
    cards = [
        "GRID,1,,0.,0.,0.", "GRID,2,,1.,0.,0.", "CONM2,11,1,,2.", "CONM2,12,2,,3.", "CELAS2,1,1000.,1,1",
        "MPC,6,2,1,1.,1,1,-3.", "SPC1,1,23456,1,2",
    ]  # fmt: skip
    deck = read(tmp_path, *cards, control="SPC = 1\nMPC = 6")
    assert frequencies(deck, 1) == pytest.approx([np.sqrt(1000.0 / 29.0) / (2 * np.pi)], rel=1e-9)


@pytest.mark.parametrize(
    "card",
    [
        "RBE2,50,9,123456,100",
        "RBAR,50,9,100,123456",
        "RBE1,50,9,123456\n,UM,100,123456",
        "RBE3,50,,100,123456,1.,123456,9",
    ],
)
def test_rigid_elements_of_all_kinds_carry_the_same_instrument(tmp_path, card):
    """One node leads: all of them are rigid arms of 0.3 m to a mass of 5 kg."""
    mass = ["GRID,100,,2.,0.,0.3", "CONM2,60,100,,5."]
    found = frequencies(read(tmp_path, *bar(), *mass, *card.split("\n")), 3)
    plain = frequencies(read(tmp_path, *bar(), "CONM2,60,9,,5.,0.,0.,0.3"), 3)
    assert found == pytest.approx(plain, rel=1e-8)


def test_rbe3_follows_the_mean_of_its_grids(tmp_path):
    """The reference of two equal grids moves by their mean: a spring there resists by a half at each."""
    cards = [
        "GRID,1,,0.,0.,0.", "GRID,2,,2.,0.,0.", "GRID,3,,1.,0.,0.",
        "CONM2,11,1,,2.", "CONM2,12,2,,2.", "CELAS2,1,800.,3,3", "CELAS2,2,100.,1,3,2,3",
        "RBE3,9,,3,3,1.,123,1,2", "SPC1,1,12456,1,2",
    ]  # fmt: skip
    deck = read(tmp_path, *cards)
    assert frequencies(deck, 2) == pytest.approx(np.sqrt([800 / 4.0, 200 / 2.0])[::-1] / (2 * np.pi), rel=1e-8)


def test_includes_are_found_from_the_including_and_from_the_main_file(tmp_path):
    (tmp_path / "parts" / "deep").mkdir(parents=True)
    cards = bar()
    (tmp_path / "parts" / "mesh.bdf").write_text("\n".join([*cards[:9], "INCLUDE 'deep/bars.bdf'"]))
    (tmp_path / "parts" / "deep" / "bars.bdf").write_text("\n".join([*cards[9:17], "include 'parts/steel.bdf'"]))
    (tmp_path / "parts" / "steel.bdf").write_text("\n".join(cards[17:]))
    path = written(tmp_path, "INCLUDE 'parts/mesh.bdf'", name="main.bdf")
    assert frequencies(read_deck(path), 1) == pytest.approx(frequencies(read(tmp_path, *cards), 1), rel=1e-12)


def test_values_are_replaced_by_property_and_by_material(tmp_path):
    given = read(tmp_path, *bar(), overrides={"pid_3": {"I1": 4e-7}, "mat_1": {"density": 15700.0}})
    assert frequencies(given, 1) == pytest.approx(frequencies(read(tmp_path, *bar()), 1), rel=5e-3)
    assert mass_and_centre(given.structure())[0] == pytest.approx(31.4)


def test_what_is_not_used_is_counted_with_its_consequence(tmp_path):
    more = ["CGAP,90,9,1,2,0.,1.,0.", "PGAP,9,0.1", "GRAV,7,,9.81,0.,0.,-1."]
    deck = read(tmp_path, *bar(), *more)
    said = [str(one) for one in deck.unused]
    assert "1 CGAP: contact is left out; the gap stays open (first at deck.bdf:25)" in said
    assert any(one.startswith("1 GRAV: loads and weight are left out") for one in said)
    text = describe(deck)
    assert "15.7 kg" in text and "8 CBAR" in text and "supports  in force: spc_1" in text


def test_defaults_of_bars_and_numbers_with_blanks_are_read(tmp_path):
    """BAROR gives property and orientation; the modulus has a blank before its exponent, as old decks write it."""
    grids = [card for card in bar() if card.startswith("GRID")]
    bars = [f"CBAR,{k + 1},,{k + 1},{k + 2}" for k in range(8)]
    steel = "MAT1    1       2.1 E+11        .3      7850."
    more = ["BAROR,,3,,,0.,1.,0.", "PBAR,3,1,1.E-3,2.E-7,8.E-7,1.E-6", steel, "SPC1,1,123456,1"]
    assert frequencies(read(tmp_path, *grids, *bars, *more)) == pytest.approx(
        frequencies(read(tmp_path, *bar())), rel=1e-12
    )


def test_rbe3_counts_a_grid_in_two_groups_by_the_sum_of_its_weights(tmp_path):
    mast = [*bar(), "GRID,20,,1.,1.,0.", "RBE2,70,5,123456,20", "GRID,21,,1.,0.,1.", "RBE2,71,5,123456,21"]
    mass = ["GRID,30,,1.2,0.4,0.3", "CONM2,61,30,,40.,,,,\n,1.,,1.,,,1."]
    twice = "RBE3,50,,30,123456,1.,123,5,20\n,21,2.,123,21"
    once = "RBE3,50,,30,123456,1.,123,5,20\n,3.,123,21"
    found = [frequencies(read(tmp_path, *mast, *mass, *card.split("\n")), 3) for card in (twice, once)]
    assert found[0] == pytest.approx(found[1], rel=1e-9)


def test_a_card_is_named_by_its_first_field_where_it_has_one():
    place = Place("a.bdf", 3)
    assert str(Card("GRID", ["7", "", "1."], place)) == "GRID 7"
    assert str(Card("SPC1", ["", "1"], place)) == "SPC1" and str(Card("ENDDATA", [], place)) == "ENDDATA"


def test_sets_are_groups_by_number_and_by_the_name_in_a_comment(tmp_path):
    named = ['$HMSET        4        1 "sensors"', '$HMSET        5        2 "outer bars"']
    mesh = read(tmp_path, *named, *bar(), "SET1,4,2,3", "SET1,5,7,8").mesh
    for group, points in (("sensors", 2), ("set_4", 2)):
        assert len(mesh.group_points(group)) == points
    for group in ("outer bars", "set_5"):
        assert {kind: len(rows) for kind, rows in mesh.group_cells(group).items()} == {"line": 2}


def test_a_material_of_a_shear_modulus_alone_twists(tmp_path):
    """MAT1 with G alone, as of shafts and of shear panels."""
    shaft = [card for card in bar() if not card.startswith("MAT1")]
    (member,) = read(tmp_path, *shaft, "MAT1,1,,8.E10,,7850.").members
    assert member.section.GJ == pytest.approx(8e10 * 1e-6) and member.section.EA < 1e-9


@pytest.mark.parametrize("card", ["PBARL,3,1,,BAR\n,0.02,0.05,1.5", "PBEAML,3,1,,BAR\n,0.02,0.05,1.5"])
def test_a_shape_and_its_mass_without_stiffness_are_read(tmp_path, card):
    """A bar 20 mm wide, 50 mm high in plane 1, with 1.5 kg/m of cables, against its numbers."""
    b, h = 0.02, 0.05
    numbers = f"PBAR,3,1,{b * h:.9g},{b * h**3 / 12:.9g},{b**3 * h / 12:.9g},1.E-7,1.5"
    kind = "CBEAM" if card.startswith("PBEAML") else "CBAR"
    cards = [one.replace("CBAR", kind) for one in bar(section=card)]
    found = read(tmp_path, *"\n".join(cards).split("\n"))
    plain = read(tmp_path, *bar(section=numbers))
    assert mass_and_centre(found.structure())[0] == pytest.approx((b * h * 7850 + 1.5) * 2.0, rel=1e-9)
    (one,), (other,) = found.members, plain.members
    for key in ("EA", "EIy", "EIz", "mass_per_length"):
        assert getattr(one.section, key) == pytest.approx(getattr(other.section, key), rel=1e-6), key


def test_components_that_an_rbe2_ties_are_along_cd(tmp_path):
    """Two grids at one place, tied along the first axis of their CD alone: the bar's tip slides on a plane askew."""
    tied = ["CORD2R,9,,0.,0.,0.,0.,0.,1.", ",1.,1.,0.", "GRID,20,,2.,0.,0.,9", "RBE2,50,9,1,20", "CONM2,60,20,,5."]
    held = "SPC1,1,23456,20"
    structure = read(tmp_path, *bar(), *tied, held).structure()
    row = 3 * int(np.flatnonzero(np.abs(structure.mesh.points[:, 0] - 2.0) < 1e-9)[-1])
    moved = structure.translation[row : row + 3].toarray()
    tip = structure.translation[row - 3 : row].toarray()
    along = np.array([1.0, 1.0, 0.0]) / np.sqrt(2)
    assert along @ moved == pytest.approx(along @ tip, abs=1e-12)
    assert np.abs(np.array([-1.0, 1.0, 0.0]) @ (moved - tip)).max() > 0.1
