"""*NONSTRUCTURAL MASS against the masses of its elements: by area, length, volume and in all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_deck_abaqus import beam, brick, deck, frequencies

from femflex.decks import DeckError
from femflex.decks.report import mass_and_centre

BEAM = beam("RECT", "10., 20.\n0., 1., 0.")  # 1 m of steel along x, 0.2e-3 m^2: 1.57 kg
STEEL = "*MATERIAL, NAME=STEEL\n*ELASTIC\n210000., 0.3\n*DENSITY\n7.85E-9\n"


def panel(thickness: float = 2.0, kind: str = "S4", more: str = "") -> str:
    """Two shells of 100 mm by 50 mm along x, FIRST and SECOND, both in PANEL: 0.0785 kg each."""
    nodes = "1, 0., 0., 0.\n2, 100., 0., 0.\n3, 200., 0., 0.\n4, 0., 50., 0.\n5, 100., 50., 0.\n6, 200., 50., 0.\n"
    cells = "1, 1, 2, 5, 4\n2, 2, 3, 6, 5\n" if kind == "S4" else "1, 1, 2, 4\n3, 2, 5, 4\n2, 2, 3, 5\n4, 3, 6, 5\n"
    sets = "*ELSET, ELSET=FIRST\n1, 3\n*ELSET, ELSET=SECOND\n2, 4\n".replace(", 3", "" if kind == "S4" else ", 3")
    sets = sets.replace(", 4", "" if kind == "S4" else ", 4")
    return (
        f"*NODE\n{nodes}*ELEMENT, TYPE={kind}, ELSET=PANEL\n{cells}{sets}{STEEL}"
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
def test_shells_take_mass_by_area_by_volume_and_in_all(kind: str, tmp_path: Path):
    """A kilogram is 1e-3 t; 2e-9 t/mm^2 are 2 kg/m^2, 1e-9 t/mm^3 1000 kg/m^3."""
    for text, first, second in (
        (added("SECOND", "MASS PER AREA", 2e-9), 0.0, 2 * 0.005),
        (added("FIRST", "MASS PER VOLUME", 1e-9), 1000 * 0.005 * 2e-3, 0.0),
        (added("PANEL", "total mass", 3e-3), 1.5, 1.5),
        (added("FIRST", "MASS PER AREA", 2e-9) + added("PANEL", "TOTAL MASS", 3e-3), 1.5 + 0.01, 1.5),
        (added("FIRST", "TOTAL MASS", 1e-3) + added("SECOND", "TOTAL MASS", 2e-3), 1.0, 2.0),
    ):
        a, b = OWN + first, OWN + second
        found = weighed(tmp_path, panel(kind=kind, more=text))
        assert found == pytest.approx((a + b, (0.05 * a + 0.15 * b) / (a + b)), rel=1e-12), text


def test_in_proportion_to_mass_or_to_volume_differs_where_densities_do(tmp_path: Path):
    light = panel().replace(
        "*SHELL SECTION", STEEL.replace("STEEL", "FOAM").replace("7.85", "0.785") + "*SHELL SECTION"
    )
    light = light.replace(
        "2.0\n", "2.0\n*SHELL SECTION, ELSET=SECOND, MATERIAL=FOAM\n6.\n*NONSTRUCTURAL MASS", 1
    ).replace("*NONSTRUCTURAL MASS", "{}")
    a, b = OWN, 0.3 * OWN  # 2 mm of one, 6 mm of a tenth of it
    by_mass = added("PANEL", "TOTAL MASS", 4e-3, ", DISTRIBUTION=MASS PROPORTIONAL")
    by_volume = added("PANEL", "TOTAL MASS", 4e-3, ", DISTRIBUTION=VOLUME PROPORTIONAL")
    for text, first in ((by_mass, 4 / 1.3), (by_volume, 1.0)):
        one, two = a + first, b + 4 - first
        found = weighed(tmp_path, light.format(text))
        assert found == pytest.approx((one + two, (0.05 * one + 0.15 * two) / (one + two)), rel=1e-9)


def test_beams_and_trusses_take_it_by_length_and_in_all(tmp_path: Path):
    assert weighed(tmp_path, BEAM + added("BOOM", "MASS PER LENGTH", 5e-6)) == pytest.approx((1.57 + 5.0, 0.5))
    three_times = frequencies(deck(tmp_path, BEAM + added("BOOM", "TOTAL MASS", 3 * 1.57e-3)))
    assert frequencies(deck(tmp_path, BEAM)) / three_times == pytest.approx(2.0 * np.ones(4), rel=1e-9)
    truss = "*NODE\n1, 0., 0., 0.\n2, 100., 0., 0.\n3, 50., 0., 0.\n"
    for kind, nodes in (("T3D2", "1, 2"), ("T3D3", "1, 3, 2")):
        text = f"{truss}*ELEMENT, TYPE={kind}, ELSET=WIRE\n7, {nodes}\n{STEEL}"
        text += "*SOLID SECTION, ELSET=WIRE, MATERIAL=STEEL\n4.\n"
        found = weighed(tmp_path, text + added("WIRE", "TOTAL MASS", 1e-3))
        assert found == pytest.approx((7850 * 4e-6 * 0.1 + 1.0, 0.05)), kind


def test_solids_become_denser(tmp_path: Path):
    elset = "*ELSET, ELSET=EVERY, GENERATE\n1, 4\n"
    light = deck(tmp_path, brick())
    mass = mass_and_centre(light.structure())[0]
    elset = light.members[0].group.upper()
    for text in (added(elset, "MASS PER VOLUME", 3 * 7.85e-9), added(elset, "TOTAL MASS", 3e-3 * mass)):
        heavy = deck(tmp_path, brick() + text)
        assert mass_and_centre(heavy.structure())[0] == pytest.approx(4 * mass)
        assert frequencies(light) / frequencies(heavy) == pytest.approx(2.0 * np.ones(4), rel=1e-9)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (added("BOOM", "MASS PER AREA", 1.0), "with UNITS=MASS PER AREA to a beam, element 1 of ELSET 'BOOM'; give"),
        (added("BOOM", "MASS PER VOLUME", 1.0), "by volume to beams or trusses, element 1 of ELSET 'BOOM'; give MASS"),
        (added("BOOM", "MASS", 1.0), "has UNITS=MASS; give TOTAL MASS, MASS PER VOLUME, MASS PER AREA, MASS"),
        (added("BOOM", "TOTAL MASS", 1.0, ", DISTRIBUTION=EVEN"),
         "has DISTRIBUTION=EVEN; give MASS PROPORTIONAL, VOLUME PROPORTIONAL"),
        (added("BOOM", "TOTAL MASS", -2e-3), "*NONSTRUCTURAL MASS leaves element 1 no mass; correct it"),
        ("*ELEMENT, TYPE=SPRINGA, ELSET=S\n90, 1, 2\n*SPRING, ELSET=S\n\n1.\n" + added("S", "TOTAL MASS", 1.0),
         "ELSET 'S' of *NONSTRUCTURAL MASS has no elements with mass"),
        ("*NONSTRUCTURAL MASS, ELSET=BOOM\n1.\n", "*NONSTRUCTURAL MASS has UNITS=none"),
        (added("BOOM", "TOTAL MASS", 1.0).replace("1.0", "one"), "'one'"),
    ],
)  # fmt: skip
def test_masses_that_cannot_be_are_refused_with_their_line(text: str, sentence: str, tmp_path: Path):
    with pytest.raises(DeckError) as found:
        deck(tmp_path, BEAM + text)
    assert sentence in str(found.value) and "model.inp" in str(found.value)


def test_elements_without_density_cannot_take_a_share(tmp_path: Path):
    with pytest.raises(
        DeckError, match="element 1 of ELSET 'PANEL' has no mass of its own; give its material a density"
    ):
        deck(tmp_path, panel(more=added("PANEL", "TOTAL MASS", 1.0)).replace("*DENSITY\n7.85E-9\n", ""))
