"""Nonstructural mass in Nastran and Abaqus decks, against the same mass elsewhere."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.abaqus_decks import STEEL as ABAQUS_STEEL
from support.abaqus_decks import beam, brick, deck
from support.abaqus_decks import frequencies as abaqus_frequencies
from support.nastran_decks import STEEL, bar, plate, read_deck_of_cards

from femflex.decks.report import mass_and_centre

PANEL = "PSHELL,3,1,0.01,1,,1"
IN_FORCE = "SPC = 1\nNSM = 5"


def matrices(folder: Path, *cards: str, control: str = IN_FORCE) -> tuple[np.ndarray, np.ndarray]:
    built = read_deck_of_cards(folder, *cards, control=control).structure()
    return built.K.toarray(), built.M.toarray()


def assert_equal_matrices(folder: Path, cards: list[str], others: list[str], control: str = IN_FORCE) -> None:
    for matrix, expected in zip(matrices(folder, *cards, control=control), matrices(folder, *others), strict=True):
        np.testing.assert_allclose(matrix, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(
    "card",
    [
        "NSM1,5,PSHELL,7.,3",
        "NSM1,5,PSHELL,7.,ALL",
        "NSM1,5,PSHELL,7.,1,THRU,9",
        "NSM1,5,ELEMENT,7.,100,THRU,107",
        "NSM1,5,ELEMENT,7.,100,101,102,103,104\n,105,106,107",
        "NSM1,5,ELSET,7.,9",
    ],
)
def test_nsm_of_a_plate_equals_that_of_its_property(card: str, tmp_path: Path):
    """Half a square metre with 7 kg/m^2."""
    heavy = plate(PANEL.replace("1,,1", "1,,1,,7."), STEEL)
    assert_equal_matrices(
        tmp_path, [*plate(PANEL, STEEL), *card.split("\n")], heavy, "SET 9 = 100 THRU 107\n" + IN_FORCE
    )


def test_nsm_of_facets_bars_and_rods(tmp_path: Path):
    corners = [f"GRID,{k + 1},,{x},{y},0." for k, (x, y) in enumerate([(0, 0), (1, 0), (1, 1), (0, 1.0)])]
    fixed, facets = "SPC1,1,123456,1,4", ["CTRIA3,1,3,1,2,3", "CTRIA3,2,3,1,3,4"]
    assert_equal_matrices(
        tmp_path, [*corners, *facets, PANEL, STEEL, fixed, "NSM1,5,PSHELL,2.,ALL"],
        [*corners, *facets, PANEL.replace("1,,1", "1,,1,,2."), STEEL, fixed],
    )  # fmt: skip
    light, heavy = bar(), bar(section="PBAR,3,1,1.E-3,2.E-7,8.E-7,1.E-6,0.5")
    assert_equal_matrices(tmp_path, [*light, "NSM1,5,PBAR,.2,3", "NSM1,5,ELEMENT,.3,ALL", "NSML,6,PBAR,3,9."], heavy)
    rod = [*corners[:2], "CROD,1,2,1,2", "CONROD,2,1,2,1,1.E-4", "PROD,2,1,1.E-4", STEEL]
    rod += ["SPC1,1,123456,1", "SPC1,1,23456,2"]
    own = ["CONROD,2,1,2,1,1.E-4,,,0.3" if card.startswith("CONROD") else card for card in rod]
    own = ["PROD,2,1,1.E-4,,,0.2" if card.startswith("PROD") else card for card in own]
    assert_equal_matrices(tmp_path, [*rod, "NSM1,5,PROD,0.2,2", "NSM1,5,CONROD,0.3,2"], own)


def test_nsm_of_single_elements(tmp_path: Path):
    """Of a bar along x: its mass and its centre, by the masses of the pieces."""
    cards = [*bar(), *(f"NSM1,5,ELEMENT,{m},{n}" for n, m in ((1, 0.4), (3, 0.8), (7, 0.2), (8, 12.0)))]
    mass, centre = mass_and_centre(read_deck_of_cards(tmp_path, *cards, control=IN_FORCE).structure())
    pieces = [(7850 * 1e-3 * 2, 1.0), (0.1, 0.125), (0.2, 0.625), (0.05, 1.625), (3.0, 1.875)]
    assert mass == pytest.approx(sum(m for m, _ in pieces))
    assert centre == pytest.approx([sum(m * x for m, x in pieces) / mass, 0, 0], abs=1e-12)


BEAM = beam("RECT", "10., 20.\n0., 1., 0.")  # 1 m of steel along x, 0.2e-3 m^2: 1.57 kg


def panel(thickness: float = 2.0, kind: str = "S4", more: str = "") -> str:
    """Two shells of 100 mm by 50 mm along x, FIRST and SECOND, both in PANEL: 0.0785 kg each."""
    nodes = "1, 0., 0., 0.\n2, 100., 0., 0.\n3, 200., 0., 0.\n4, 0., 50., 0.\n5, 100., 50., 0.\n6, 200., 50., 0.\n"
    cells = "1, 1, 2, 5, 4\n2, 2, 3, 6, 5\n" if kind == "S4" else "1, 1, 2, 4\n3, 2, 5, 4\n2, 2, 3, 5\n4, 3, 6, 5\n"
    sets = "*ELSET, ELSET=FIRST\n1, 3\n*ELSET, ELSET=SECOND\n2, 4\n".replace(", 3", "" if kind == "S4" else ", 3")
    sets = sets.replace(", 4", "" if kind == "S4" else ", 4")
    return (
        f"*NODE\n{nodes}*ELEMENT, TYPE={kind}, ELSET=PANEL\n{cells}{sets}{ABAQUS_STEEL}"
        f"*SHELL SECTION, ELSET=PANEL, MATERIAL=STEEL\n{thickness}\n{more}*BOUNDARY\n1, ENCASTRE\n4, ENCASTRE\n"
    )


def added(elset: str, units: str, value: float, more: str = "") -> str:
    return f"*NONSTRUCTURAL MASS, ELSET={elset}, UNITS={units}{more}\n{value}\n"


def weighed(folder: Path, text: str) -> tuple[float, float]:
    """Mass [kg] and place of its centre along x [m]."""
    mass, centre = mass_and_centre(deck(folder, text).structure())
    return mass, centre[0]


OWN = 7850 * 0.1 * 0.05 * 2e-3


@pytest.mark.parametrize("kind", ["S4", "S3"])
def test_nonstructural_mass_of_abaqus_shells(kind: str, tmp_path: Path):
    """A kilogram is 1e-3 t; 2e-9 t/mm^2 are 2 kg/m^2, 1e-9 t/mm^3 1000 kg/m^3."""
    for text, first, second in (
        (added("SECOND", "MASS PER AREA", 2e-9), 0.0, 2 * 0.005),
        (added("FIRST", "MASS PER VOLUME", 1e-9), 1000 * 0.005 * 2e-3, 0.0),
        (added("PANEL", "total mass", 3e-3), 1.5, 1.5),
        (added("FIRST", "MASS PER AREA", 2e-9) + added("PANEL", "TOTAL MASS", 3e-3), 1.5 + 0.01, 1.5),
        (added("FIRST", "TOTAL MASS", 1e-3) + added("SECOND", "TOTAL MASS", 2e-3), 1.0, 2.0),
    ):
        a, b = OWN + first, OWN + second
        computed = weighed(tmp_path, panel(kind=kind, more=text))
        assert computed == pytest.approx((a + b, (0.05 * a + 0.15 * b) / (a + b)), rel=1e-12), text


def test_nonstructural_mass_in_proportion(tmp_path: Path):
    light = panel().replace(
        "*SHELL SECTION", ABAQUS_STEEL.replace("STEEL", "FOAM").replace("7.85", "0.785") + "*SHELL SECTION"
    )
    light = light.replace(
        "2.0\n", "2.0\n*SHELL SECTION, ELSET=SECOND, MATERIAL=FOAM\n6.\n*NONSTRUCTURAL MASS", 1
    ).replace("*NONSTRUCTURAL MASS", "{}")
    a, b = OWN, 0.3 * OWN  # 2 mm of one, 6 mm of a tenth of it
    by_mass = added("PANEL", "TOTAL MASS", 4e-3, ", DISTRIBUTION=MASS PROPORTIONAL")
    by_volume = added("PANEL", "TOTAL MASS", 4e-3, ", DISTRIBUTION=VOLUME PROPORTIONAL")
    for text, first in ((by_mass, 4 / 1.3), (by_volume, 1.0)):
        one, two = a + first, b + 4 - first
        computed = weighed(tmp_path, light.format(text))
        assert computed == pytest.approx((one + two, (0.05 * one + 0.15 * two) / (one + two)), rel=1e-9)


def test_nonstructural_mass_of_abaqus_beams_and_trusses(tmp_path: Path):
    assert weighed(tmp_path, BEAM + added("BOOM", "MASS PER LENGTH", 5e-6)) == pytest.approx((1.57 + 5.0, 0.5))
    three_times = abaqus_frequencies(deck(tmp_path, BEAM + added("BOOM", "TOTAL MASS", 3 * 1.57e-3)))
    assert abaqus_frequencies(deck(tmp_path, BEAM)) / three_times == pytest.approx(2.0 * np.ones(4), rel=1e-9)
    truss = "*NODE\n1, 0., 0., 0.\n2, 100., 0., 0.\n3, 50., 0., 0.\n"
    for kind, nodes in (("T3D2", "1, 2"), ("T3D3", "1, 3, 2")):
        text = f"{truss}*ELEMENT, TYPE={kind}, ELSET=WIRE\n7, {nodes}\n{ABAQUS_STEEL}"
        text += "*SOLID SECTION, ELSET=WIRE, MATERIAL=STEEL\n4.\n"
        computed = weighed(tmp_path, text + added("WIRE", "TOTAL MASS", 1e-3))
        assert computed == pytest.approx((7850 * 4e-6 * 0.1 + 1.0, 0.05)), kind


def test_nonstructural_mass_of_abaqus_solids(tmp_path: Path):
    light = deck(tmp_path, brick())
    mass = mass_and_centre(light.structure())[0]
    elset = light.members[0].group.upper()
    for text in (added(elset, "MASS PER VOLUME", 3 * 7.85e-9), added(elset, "TOTAL MASS", 3e-3 * mass)):
        heavy = deck(tmp_path, brick() + text)
        assert mass_and_centre(heavy.structure())[0] == pytest.approx(4 * mass)
        assert abaqus_frequencies(light) / abaqus_frequencies(heavy) == pytest.approx(2.0 * np.ones(4), rel=1e-9)
