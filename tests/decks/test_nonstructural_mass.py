"""Nonstructural mass by cards of its own: NSM, NSM1, NSML, NSML1 and NSMADD, against the same mass elsewhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.nastran_decks import STEEL, bar, frequencies, read
from test_card_by_card import lines, plate

from femflex.decks import DeckError
from femflex.decks.report import mass_and_centre

PANEL = "PSHELL,3,1,0.01,1,,1"
IN_FORCE = "SPC = 1\nNSM = 5"
N = 8  # elements of the plate, 0.0625 m^2 each, and of the bar, 0.25 m each


def matrices(folder: Path, *cards: str, control: str = IN_FORCE) -> tuple[np.ndarray, np.ndarray]:
    built = read(folder, *cards, control=control).structure()
    return built.K.toarray(), built.M.toarray()


def same(folder: Path, cards: list[str], others: list[str], control: str = IN_FORCE) -> None:
    for one, other in zip(matrices(folder, *cards, control=control), matrices(folder, *others), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12 * np.abs(other).max())


@pytest.mark.parametrize(
    "card",
    [
        "NSM,5,PSHELL,3,7.",
        "NSM1,5,PSHELL,7.,3",
        "NSM1,5,PSHELL,7.,ALL",
        "NSM1,5,PSHELL,7.,1,THRU,9",
        "NSM1,5,ELEMENT,7.,100,THRU,107",
        "NSML,5,PSHELL,3,3.5",
        "NSML1,5,PSHELL,3.5,3",
        "NSML1,5,ELEMENT,3.5,100,101,102,103,104\n,105,106,107",
        "NSML1,5,ELSET,3.5,9",
    ],
)
def test_mass_of_all_elements_is_that_of_their_property(card: str, tmp_path: Path):
    """Half a square metre with 7 kg/m^2."""
    heavy = plate(PANEL.replace("1,,1", "1,,1,,7."), STEEL)
    same(tmp_path, [*plate(PANEL, STEEL), *card.split("\n")], heavy, "SET 9 = 100 THRU 107\n" + IN_FORCE)


def test_facets_and_bars_and_rods_carry_it_as_their_property_does(tmp_path: Path):
    corners = [f"GRID,{k + 1},,{x},{y},0." for k, (x, y) in enumerate([(0, 0), (1, 0), (1, 1), (0, 1.0)])]
    held, facets = "SPC1,1,123456,1,4", ["CTRIA3,1,3,1,2,3", "CTRIA3,2,3,1,3,4"]
    same(
        tmp_path, [*corners, *facets, PANEL, STEEL, held, "NSM1,5,PSHELL,2.,ALL"],
        [*corners, *facets, PANEL.replace("1,,1", "1,,1,,2."), STEEL, held],
    )  # fmt: skip
    light, heavy = bar(), bar(section="PBAR,3,1,1.E-3,2.E-7,8.E-7,1.E-6,0.5")
    same(tmp_path, [*light, "NSM,5,PBAR,3,0.5"], heavy)
    same(tmp_path, [*light, "NSML1,5,PBAR,1.,3"], heavy)  # 2 m
    rod = [
        *corners[:2],
        "CROD,1,2,1,2",
        "CONROD,2,1,2,1,1.E-4",
        "PROD,2,1,1.E-4",
        STEEL,
        "SPC1,1,123456,1",
        "SPC1,1,23456,2",
    ]
    own = ["CONROD,2,1,2,1,1.E-4,,,0.3" if card.startswith("CONROD") else card for card in rod]
    own = ["PROD,2,1,1.E-4,,,0.2" if card.startswith("PROD") else card for card in own]
    same(tmp_path, [*rod, "NSM,5,PROD,2,0.2", "NSM,5,CONROD,2,0.3"], own)


def test_single_elements_and_pairs_have_values_of_their_own(tmp_path: Path):
    """Of a bar along x: its mass and its centre, by the masses of the pieces."""
    cards = [*bar(), *lines("NSM", 5, "ELEMENT", 1, 0.4, 3, 0.8, 7, 0.2), "NSML,5,ELEMENT,8,3."]
    mass, centre = mass_and_centre(read(tmp_path, *cards, control=IN_FORCE).structure())
    pieces = [(7850 * 1e-3 * 2, 1.0), (0.1, 0.125), (0.2, 0.625), (0.05, 1.625), (3.0, 1.875)]
    assert mass == pytest.approx(sum(m for m, _ in pieces))
    assert centre == pytest.approx([sum(m * x for m, x in pieces) / mass, 0, 0], abs=1e-12)


def test_masses_add_up_over_cards_and_sets(tmp_path: Path):
    cards = [*plate(PANEL, STEEL), "NSM,6,PSHELL,3,4.", "NSM1,7,ELEMENT,3.,100,THRU,107", "NSM,8,PSHELL,3,90."]
    deck = read(tmp_path, *cards, "NSMADD,5,6,7", control=IN_FORCE)
    assert mass_and_centre(deck.structure())[0] == pytest.approx(0.5 * (7850 * 0.01 + 7.0))
    assert "NSM cards add 3.5 kg of nonstructural mass to 8 elements" in deck.notes
    assert [str(one) for one in deck.unused if "NSM" in one.card] == [
        "1 NSM: of set 8, which case control does not select (first at deck.bdf:34)"
    ]


def test_units_of_the_deck_and_its_factor_of_masses_count(tmp_path: Path):
    """Weights in lbf and inches: 0.002 lbf/in^2 over one square metre weigh 3.1 lbf."""
    size = 39.37007874
    grids = [f"GRID,{k + 1},,{x * size},{y * size},0." for k, (x, y) in enumerate([(0, 0), (1, 0), (1, 1), (0, 1.0)])]
    cards = [
        *grids, "CQUAD4,1,3,1,2,3,4", "PSHELL,3,1,0.4,1,,1", "MAT1,1,1.E7,,0.3,0.1", "SPC1,1,123456,1,4",
        "NSM,5,PSHELL,3,0.002", "PARAM,WTMASS,0.002590",
    ]  # fmt: skip
    deck = read(tmp_path, *cards, control=IN_FORCE, units="in-lbf-s")
    weight = (0.1 * 0.4 + 0.002) * size**2  # lbf
    assert mass_and_centre(deck.structure())[0] == pytest.approx(weight * 0.45359237, rel=1e-4)


def test_a_heavy_bar_is_slower_by_the_root_of_its_mass(tmp_path: Path):
    own = 7850 * 1e-3
    light, heavy = (read(tmp_path, *bar(), *more, control=IN_FORCE) for more in ([], [f"NSM,5,PBAR,3,{3 * own}"]))
    assert frequencies(light, 2) / frequencies(heavy, 2) == pytest.approx([2.0, 2.0], rel=1e-3)


def test_sets_that_nothing_selects_add_nothing_and_are_named(tmp_path: Path):
    cards = [*plate(PANEL, STEEL), "NSM,6,PSHELL,3,4."]
    deck = read(tmp_path, *cards)
    assert mass_and_centre(deck.structure())[0] == pytest.approx(0.5 * 78.5)
    assert any("1 NSM: of set 6, which case control does not select" in str(one) for one in deck.unused)
    deck = read(tmp_path, *cards, control=IN_FORCE)
    assert "NSM set 5 is in force, and the deck has no card of it; it adds no mass" in deck.notes


@pytest.mark.parametrize(
    ("card", "sentence"),
    [
        ("NSM,5,PSHELL,4,7.", "NSM 5: names property 4"),
        ("NSM1,5,ELEMENT,7.,100,300", "NSM1 5: names element 300"),
        ("NSM1,5,ELSET,7.,3", "NSM1 5: names set 3"),
        ("NSM1,5,PBAR,7.,ALL", "NSM1 5: names no element of the deck that takes nonstructural mass"),
        ("NSM1,5,PSHELL,7.,10,THRU,19", "NSM1 5: names no element of the deck that takes nonstructural mass"),
        ("NSM,5,PSOLID,3,7.", "NSM 5 has 'PSOLID' in field 3; nonstructural mass is read of ELEMENT, ELSET, CONROD"),
        ("NSM,5,PSHELL,3", "NSM 5 has nothing in field 5, where a number is needed"),
        ("NSM,5,PSHELL,3,-7.", "NSM 5 makes the nonstructural mass of element 100 negative; correct it"),
        ("NSML1,5,PSHELL,7.,3\n,DISTR,VOLUME", "NSML1 5 has DISTR, by volume or mass, which is not read"),
    ],
)  # fmt: skip
def test_cards_that_cannot_be_are_refused(card: str, sentence: str, tmp_path: Path):
    with pytest.raises(DeckError) as found:
        read(tmp_path, *plate(PANEL, STEEL), *card.split("\n"), control=IN_FORCE)
    assert sentence in str(found.value)


def test_one_lumped_mass_is_not_spread_over_areas_and_lengths(tmp_path: Path):
    cards = [*plate(PANEL, STEEL), "CBAR,900,8,1,2,0.,0.,1.", "PBAR,8,1,1.E-3,2.E-7,8.E-7,1.E-6"]
    with pytest.raises(DeckError, match="NSML1 5 spreads a mass over elements with areas and with lengths"):
        read(tmp_path, *cards, "NSML1,5,ELEMENT,7.,100,900", control=IN_FORCE)
    with pytest.raises(DeckError, match="PBAR 8 and nonstructural mass give a mass per length below zero"):
        read(tmp_path, *cards, "NSM,5,PBAR,8,-9.", control=IN_FORCE)
