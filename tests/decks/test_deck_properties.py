"""Units, masses, names of nodes and the recognition of decks."""

from __future__ import annotations

import numpy as np
import pytest
from support.nastran_decks import bar, read_deck_of_cards, written

from femflex.decks import Deck, read_deck, units_of
from femflex.decks.report import mass_and_centre
from femflex.decks.units import likely_units
from femflex.fem import Member, Support
from femflex.fem.sections.library import StiffnessSection
from femflex.mesh import Mesh

POUND, INCH, FOOT, G0 = 0.45359237, 0.0254, 0.3048, 9.80665
NAMES = {  # length, mass, time in SI
    "m-kg-s": (1, 1, 1), "mm-t-s": (1e-3, 1e3, 1), "mm-kg-ms": (1e-3, 1, 1e-3), "mm-g-ms": (1e-3, 1e-3, 1e-3),
    "cm-g-s": (1e-2, 1e-3, 1), "in-lbf-s": (INCH, POUND * G0 / INCH, 1), "ft-lbf-s": (FOOT, POUND * G0 / FOOT, 1),
    "in-lb-s": (INCH, POUND, 1), "in-lbm-s": (INCH, POUND, 1), "ft-slug-s": (FOOT, POUND * G0 / FOOT, 1),
    "in-slinch-s": (INCH, POUND * G0 / INCH, 1), "um-kg-us": (1e-6, 1, 1e-6), "mm-N-s": (1e-3, 1e3, 1),
    "mm-kN-ms": (1e-3, 1.0, 1e-3), "mm-kgf-s": (1e-3, G0 * 1e3, 1), "m-N-ms": (1, 1e-6, 1e-3), "SI": (1, 1, 1),
    "mm_t_s": (1e-3, 1e3, 1),
}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_units_by_name(name):
    length, mass, time = NAMES[name]
    u = units_of(name)
    assert [u.length, u.mass, u.time] == pytest.approx([length, mass, time])
    force = mass * length / time**2
    assert [u.force, u.moment, u.pressure, u.density, u.inertia, u.spring] == pytest.approx(
        [force, force * length, force / length**2, mass / length**3, mass * length**2, force / length]
    )
    assert units_of(u) is u


@pytest.mark.parametrize("name", ["m-kg-s", "mm-t-s", "mm-kg-ms", "in-lbf-s", "cm-g-s"])
def test_likely_units_of_metal(name):
    u = units_of(name)
    E, rho, size = [7e10 / u.pressure, 2e11 / u.pressure], [2700 / u.density, 7850 / u.density], 2.0 / u.length
    best, _ = likely_units(E, rho, size)
    computed = units_of(best)
    assert [computed.pressure, computed.density, computed.length] == pytest.approx([u.pressure, u.density, u.length])


def test_mass_and_centre_of_bars_and_masses(tmp_path):
    deck = read_deck_of_cards(tmp_path, *bar(), "CONM2,50,5,,3.,.1,.2,.3", "CONM2,51,9,,2.")
    mass, centre = mass_and_centre(deck.structure())
    own = 7850 * 1e-3 * 2.0
    expected = (own * np.array([1.0, 0, 0]) + 3 * np.array([1.1, 0.2, 0.3]) + 2 * np.array([2.0, 0, 0])) / (own + 5)
    assert mass == pytest.approx(own + 5) and centre == pytest.approx(expected, rel=1e-6)


def test_decks_are_recognised_by_content(tmp_path):
    path = written(tmp_path, *bar(), name="mast.inp")
    assert read_deck(path).solver == "Nastran"
    text = "*NODE\n1, 0.\n2, 1.\n*ELEMENT, TYPE=MASS, ELSET=M\n1, 2\n*MASS, ELSET=M\n1.\n"
    for name in ("a.bdf", "a.txt", "a.INP"):
        (tmp_path / name).write_text(text)
        assert read_deck(tmp_path / name).solver == "Abaqus"
    (tmp_path / "a.txt").write_text(
        "$ a comment\nGRID    1               0.      0.      0.\nCONM2   2       1               1.\n"
    )
    assert read_deck(tmp_path / "a.txt").solver == "Nastran"


def deck() -> Deck:
    mesh = Mesh([[0, 0, 0], [1, 0, 0]], {"line": [[0, 1]]}, {"pid_3": {"line": [0]}}, {"spc_1-123456": [0]})
    member = Member("pid_3", "beam", StiffnessSection(1e7, 50.0, 80.0, 40.0, 1.0))
    fixed = {"spc_1": {"spc_1-123456": Support(("x", "y", "z", "rx", "ry", "rz"))}}
    return Deck(
        "one.bdf", "Nastran", mesh, (member,), supports=fixed, default_supports=("spc_1",), points_of_ids={7: 1}
    )
