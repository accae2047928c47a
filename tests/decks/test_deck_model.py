"""The neutral deck: units, plausibility, names of sets and nodes, and the way to a Structure."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.decks import Deck, DeckError, units_of
from femflex.decks.findings import Findings, Place
from femflex.decks.units import implausible
from femflex.fem import Member, Support
from femflex.fem.sections.library import StiffnessSection
from femflex.mesh import Mesh


def test_units_are_known_by_mass_or_by_force():
    mm = units_of("mm-t-s")
    assert mm.force == pytest.approx(1.0) and mm.pressure == pytest.approx(1e6) and mm.density == pytest.approx(1e12)
    inch = units_of("in-lbf-s")
    assert inch.mass == pytest.approx(175.126835, rel=1e-8)  # NIST SP 811: lbf s^2 / in
    assert inch.pressure == pytest.approx(6894.757, rel=1e-6)  # psi
    assert units_of("mm-kg-ms").pressure == pytest.approx(1e9)


def test_unknown_units_are_refused_with_the_known_ones():
    with pytest.raises(ValueError, match=r"units are 'mm-tonne-s'; .*masses kg, g, t"):
        units_of("mm-tonne-s")


def test_steel_in_millimetres_read_as_metres_is_said_to_be_implausible():
    (text,) = implausible(units_of("m-kg-s"), [210000.0], [7.85e-9], 800.0, 1e-3)
    assert "density of 7.85e-09 kg/m^3" in text and "mm-t-s" in text
    assert not implausible(units_of("mm-t-s"), [2.1e11], [7850.0], 0.8, 1.0)


def deck() -> Deck:
    mesh = Mesh([[0, 0, 0], [1, 0, 0]], {"line": [[0, 1]]}, {"pid_3": {"line": [0]}}, {"spc_1-123456": [0]})
    member = Member("pid_3", "beam", StiffnessSection(1e7, 50.0, 80.0, 40.0, 1.0))
    held = {"spc_1": {"spc_1-123456": Support(("x", "y", "z", "rx", "ry", "rz"))}}
    return Deck("one.bdf", "Nastran", mesh, (member,), supports=held, default_supports=("spc_1",), points_of_ids={7: 1})


def test_a_deck_becomes_a_structure_with_its_own_supports():
    structure = deck().structure()
    held = structure.held_dofs(deck().held())
    assert len(held) == 6
    one = np.array([1.0, 0, 0] * 2)
    assert one @ (structure.translation.toarray() @ np.linalg.pinv(structure.translation.toarray())) @ one > 1.9


def test_nodes_are_named_by_number():
    assert deck().with_named(["node_7", "pid_3"]).mesh.group_points("node_7").tolist() == [1]
    other = deck()  # names that only begin or end so are no nodes
    assert other.with_named(["node_7b", "my_node_7", "node_", "node_7 "]) is other
    with pytest.raises(ValueError, match=r"one.bdf has no node 9 .*near it are \[7\]"):
        deck().with_named(["node_9"])
    with pytest.raises(ValueError, match=r"no set of supports 'spc_2'; it has \['spc_1'\].*Did you mean 'spc_1'"):
        deck().held(["spc_2"])


def test_problems_of_a_deck_are_reported_together(tmp_path):
    found = Findings()
    found.problem("CQUAD4 3 names property 7, which the deck does not have", Place("a.bdf", 12))
    found.problem("GRID 5 is given twice", Place("a.bdf", 40))
    found.unused("CGAP", "contact is left out; the gap stays open", Place("a.bdf", 3), 2)
    found.unused("CGAP", "contact is left out; the gap stays open", Place("a.bdf", 9))
    assert [str(one) for one in found.left_out] == [
        "3 CGAP: contact is left out; the gap stays open (first at a.bdf:3)"
    ]
    with pytest.raises(DeckError, match=r"it has 2 problems:\n  a.bdf:12: CQUAD4 3 .*\n  a.bdf:40: GRID 5"):
        found.check(tmp_path / "a.bdf")
