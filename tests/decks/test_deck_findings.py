"""Units, notes, groups and what nothing resists: what decks of every solver share, by numbers worked out here."""

from __future__ import annotations

import numpy as np
import pytest
from support.nastran_decks import STEEL, bar, frequencies, read, written

from femflex.decks import DeckError, Units, read_deck, units_of
from femflex.decks.builder import Builder
from femflex.decks.findings import Findings, Place, toml_key
from femflex.decks.report import describe, doubts, mass_and_centre, without_mass
from femflex.decks.singular import unresisted
from femflex.decks.units import implausible, likely_units

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
def test_units_are_what_their_names_say(name):
    length, mass, time = NAMES[name]
    u = units_of(name)
    assert [u.length, u.mass, u.time] == pytest.approx([length, mass, time])
    force = mass * length / time**2
    assert [u.force, u.moment, u.pressure, u.density, u.inertia, u.spring] == pytest.approx(
        [force, force * length, force / length**2, mass / length**3, mass * length**2, force / length]
    )
    assert units_of(u) is u


def test_the_most_implausible_value_of_each_kind_is_named_with_its_range():
    """Of two moduli the one that lies further off by decades, on either side; what is usual is not named."""
    (text,) = implausible(Units(), [2e13, 10.0, 2e11], [0.01, 7850.0], 5e3, 1e9)
    assert text.startswith("read in m-kg-s it has a Young's modulus of 10 Pa (usual are 1000 to 2e+12)")
    for part in ("a density of 0.01 kg/m^3 (usual are 1 to 2.5e+04)", "an extent of 5000 m (usual are 0.001 to 2000)",
                 "and a mass of 1e+09 kg (usual are 1e-06 to 1e+08)"):  # fmt: skip
        assert part in text
    assert not implausible(Units(), [1e3, 2e12, 0.0], [1.0, 25e3, 0.0], 2e3, 1e8) and not implausible(
        Units(), [], [], 0.0, 0.0
    )
    (text,) = implausible(units_of("mm-t-s"), [2.1e11 * 1e6], [7850.0 * 1e12], 2.0e-3, 1.0)
    assert "In m-kg-s" in text and "mm-t-s it has" in text and "or mm-t-s" not in text


@pytest.mark.parametrize("name", ["m-kg-s", "mm-t-s", "mm-kg-ms", "in-lbf-s", "cm-g-s"])
def test_likely_units_are_those_in_which_metal_is_metal(name):
    u = units_of(name)
    E, rho, size = [7e10 / u.pressure, 2e11 / u.pressure], [2700 / u.density, 7850 / u.density], 2.0 / u.length
    best, why = likely_units(E, rho, size)
    found = units_of(best)
    assert [found.pressure, found.density, found.length] == pytest.approx([u.pressure, u.density, u.length])
    assert "E is 200 GPa, a density of 7850 kg/m^3, and it spans 2 m" in why
    assert likely_units([], rho, size) == ("m-kg-s", "assumed: the deck has no Young's modulus to judge by")
    assert "density" not in likely_units(E, [], size)[1]


# Findings


def test_many_problems_are_cut_short_with_their_number(tmp_path):
    found = Findings()
    for k in range(23):
        found.problem(f"GRID {k} is wrong", Place("a.bdf", k))
    with pytest.raises(DeckError) as error:
        found.check(tmp_path / "a.bdf")
    lines = str(error.value).splitlines()
    assert lines[0] == "a.bdf cannot be used; it has 23 problems:" and lines[-1] == "  and 3 more"
    assert len(lines) == 22 and lines[20] == "  a.bdf:19: GRID 19 is wrong" and len(error.value.problems) == 23
    one = Findings()
    for k in (7, 8, 9):
        one.problem("names property 3", Place("a.bdf", k), f"CBAR {k}")
    one.problem("names property 3", Place("a.bdf", 10), "CROD 1")
    assert one.problems == ["a.bdf:7: CBAR 7: names property 3 (and 2 more CBAR)", "a.bdf:10: CROD 1: names property 3"]
    one.note("twice"), one.note("twice")
    assert one.notes == ["twice"]
    one.use("GRID", 3), one.use("GRID")
    assert one.used["GRID"] == 4


def test_a_deck_without_densities_says_which_material_to_give_one():
    found = Findings()
    assert found.note_no_mass([0.0, 2.0], ["a"], "x:1") == "" and not found.notes
    text = found.note_no_mass([0.0, 0.0], ["my steel", "b"], "a.inp:7")
    assert "the first is my steel, a.inp:7" in text and 'overrides = { "my steel" = { density = ... } }' in text
    assert found.notes == [text] and "no material, and no mass" in found.note_no_mass([], [], "")
    assert [toml_key(k) for k in ("mat_1", "a-b", "a b", "ä")] == ["mat_1", "a-b", '"a b"', '"\\u00e4"']


# The builder


def test_cells_are_gathered_by_key_and_groups_by_name():
    build = Builder()
    for n, x in ((7, 0.0), (9, 1.0), (4, 2.0), (8, 3.0)):
        build.node(n, [x, 0.0, 0.0])
    assert build.node(9, [5.0, 0, 0]) == 1 and build.row_of == {7: 0, 9: 1, 4: 2, 8: 3}
    build.cell("line", [0, 1], "a", "pid_3", "beam", 1.0, groups=("boom",), number=31)
    build.cell("line", [1, 2], "b", "pid_3", "beam", 2.0, number=32, options={"shear": True})
    build.cell("line", [2, 3], "a", "pid_3", "beam", 1.0, number=33)
    build.cell("line", [3, 0], "c", "pid_5", "rod", 3.0)
    assert [(m.group, m.section, dict(m.options)) for m in build.members()] == [
        ("pid_3-part1", 1.0, {}), ("pid_3-part2", 2.0, {"shear": True}), ("pid_5", 3.0, {})
    ]  # fmt: skip
    mesh = build.mesh()
    cells = {
        name: mesh.group_cells(name)["line"].tolist()
        for name in ("pid_3", "pid_3-part1", "pid_3-part2", "boom", "pid_5")
    }
    assert cells == {"pid_3": [[0, 1], [1, 2], [2, 3]], "pid_3-part1": [[0, 1], [2, 3]], "pid_3-part2": [[1, 2]],
                     "boom": [[0, 1]], "pid_5": [[3, 0]]}  # fmt: skip
    assert build.cell_of == {31: [("line", 0)], 32: [("line", 1)], 33: [("line", 2)]} and build.families() == {
        "beam",
        "rod",
    }


def test_values_of_cells_are_one_where_they_are_alike_and_by_cell_where_not():
    build = Builder()
    for x in range(6):
        build.point([float(x), 0, 0])
    for k, (t, axis) in enumerate((((0.1, 0.1, 0.1), (1.0, 0, 0)), ((0.1, 0.1, 0.2), (0.0, 1, 0)))):
        build.cell("triangle", [k, k + 1, k + 2], "a", "p", "shell", fields={"thickness": t, "axis": np.array(axis)})
        build.cell("triangle", [k, k + 1, k + 2], "b", "q", "shell",
                   fields={"thickness": (0.3,) * 3, "axis": np.array([0.6, 0.8 + 1e-11 * k, 0.0])})  # fmt: skip
    varied, plain = (dict(member.options) for member in build.members())
    assert plain == {"thickness": 0.3, "axis": (0.6, 0.8, 0.0)}
    assert varied["thickness"]["triangle"].tolist() == [[0.1, 0.1, 0.1], [0.1, 0.1, 0.2]]
    assert [c["triangle"].tolist() for c in varied["axis"]] == [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]


# Decks


def test_supports_of_several_names_are_united_and_nodes_become_groups(tmp_path):
    deck = read(tmp_path, *bar(), "SPC1,2,2,9", "SPC1,3,3,5")
    assert set(deck.held(["spc_2", "spc_3"])) == set(deck.held(["spc_2"])) | set(deck.held(["spc_3"]))
    assert set(deck.held()) == set(deck.held(["spc_1"])) and deck.held([]) == {}
    named = deck.with_named(["node_9", "node_2", "pid_3", "spc_1"])
    assert [named.mesh.group_points(f"node_{n}").tolist() for n in (9, 2)] == [
        [deck.points_of_ids[9]],
        [deck.points_of_ids[2]],
    ]
    assert deck.with_named(["pid_3"]) is deck
    with pytest.raises(ValueError, match=r"has no node 20 with .*; near it are \[7, 8, 9\]"):
        deck.with_named(["node_20"])
    assert deck.point_names()[deck.points_of_ids[4]] == "GRID 4"
    assert deck.structure().point_names == deck.point_names()


def spokes(n: int, turn: float = 0.0) -> list[str]:
    """Rods of 1 m from held grids, each free at its other end, along x or turned about z and y."""
    a, b = np.cos(turn), np.sin(turn)
    cards = []
    for k in range(n):
        cards += [f"GRID,{2 * k + 1},,0.,{3.0 * k},0.", f"GRID,{2 * k + 2},,{a * a},{3.0 * k + a * b},{b}"]
        cards += [f"CROD,{k + 1},3,{2 * k + 1},{2 * k + 2}"]
    return [*cards, "PROD,3,1,1.-4", STEEL, "SPC1,1,123," + ",".join(str(2 * k + 1) for k in range(min(n, 6)))]


def test_what_nothing_resists_is_fixed_and_listed_with_the_first_six(tmp_path):
    deck = read(tmp_path, *spokes(8))
    (note,) = (n for n in deck.notes if "have no stiffness" in n)
    # y and z at the eight tips, and at the two roots that no card holds
    assert note.startswith("20 components of nodes have no stiffness and are fixed")
    assert "y, z at nodes 2, 4, 6, 8, 10, 12 and 4 more" in note
    assert deck.default_supports == ("spc_1", "autospc")
    held = {int(n) for group in deck.supports["autospc"] for n in deck.mesh.group_points(group)}
    assert held == {deck.points_of_ids[n] for n in (2, 4, 6, 8, 10, 12, 13, 14, 15, 16)}


def test_directions_that_nothing_resists_stand_across_a_skew_rod(tmp_path):
    deck = read(tmp_path, *spokes(1, 0.6))
    (support,) = deck.supports["autospc"].values()
    axes = np.asarray(support.axes)
    a, b = np.cos(0.6), np.sin(0.6)
    rod = np.array([a * a, a * b, b])
    loose = [axes[("x", "y", "z").index(c)] for c in support.components]
    assert len(loose) == 2 and np.abs(np.array(loose) @ rod).max() < 1e-6
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert any("of skew axes at nodes 1, 2;" in note for note in deck.notes)
    structure = deck.structure()
    (nodes, found), *_ = unresisted(structure, np.array([deck.points_of_ids[2]]))
    assert nodes.tolist() == [deck.points_of_ids[2]] and len(found.components) == 2


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_what_nothing_resists_beside_a_component_that_depends_is_fixed_along_skew_axes_too(tmp_path, angle):
    """Grid 15 follows the tip of a beam along y of its own axes, a rod holds it along z, and nothing along x."""
    a, b = np.cos(angle), np.sin(angle)
    cards = ["CORD2R,7,,0.,0.,0.,0.,0.,1.", f",{a:.12f},{b:.12f},0.", "GRID,15,,2.5,.3,0.,7", "GRID,16,,2.5,.3,1."]
    cards += ["CROD,20,4,15,16", "PROD,4,1,1.E-3", "RBE2,21,9,2,15", "SPC1,1,123456,16"]
    deck = read(tmp_path, *bar(), *cards)
    ((group, support),) = deck.supports["autospc"].items()
    assert deck.mesh.group_points(group).tolist() == [deck.points_of_ids[15]]
    (component,) = support.components
    direction = np.asarray(support.axes)[("x", "y", "z").index(component)]
    assert np.abs(direction) == pytest.approx([a, b, 0.0], abs=1e-9)
    assert len(frequencies(deck)) == 4


def test_mass_and_centre_are_those_of_bars_and_point_masses(tmp_path):
    deck = read(tmp_path, *bar(), "CONM2,50,5,,3.,.1,.2,.3", "CONM2,51,9,,2.")
    mass, centre = mass_and_centre(deck.structure())
    own = 7850 * 1e-3 * 2.0
    wanted = (own * np.array([1.0, 0, 0]) + 3 * np.array([1.1, 0.2, 0.3]) + 2 * np.array([2.0, 0, 0])) / (own + 5)
    assert mass == pytest.approx(own + 5) and centre == pytest.approx(wanted, rel=1e-6)
    assert not without_mass(deck, deck.structure()) and not doubts(deck, deck.structure())
    light = read(tmp_path, *[c.replace("7850.", "") for c in bar()])
    assert without_mass(light, light.structure()) and "mat_1" in light.no_density
    tiny = read(tmp_path, *[c.replace("7850.", "1.-9") for c in bar()])
    assert not without_mass(tiny, tiny.structure())
    (text,) = doubts(tiny, tiny.structure())
    assert "a density of 1e-09 kg/m^3" in text


def test_a_deck_is_described_with_its_numbers(tmp_path):
    cards = [*bar(), "GRID,20,,1.,-.5,.25", "CONM2,50,20,,3.", "RBE2,60,5,123456,20", "EIGRL,1,,,5", "SPC1,2,2,9"]
    lines = describe(read(tmp_path, *cards, units="mm-t-s", overrides={"mat_1": {"E": 2.1e11}})).splitlines()
    assert lines[0] == "deck.bdf: Nastran deck, read in mm-t-s (1 = 0.001 m, 1000 kg, 1 s)"
    text = describe(read(tmp_path, *cards))
    m = 15.7 + 3.0
    for line in (
        f"mass      {m:.6g} kg, centre (1, {-1.5 / m:.6g}, {0.75 / m:.6g}) m",
        "extent    (2, 0.5, 0.25) m, from (0, -0.5, 0) to (2, 0, 0.25) m",
        "of 10 nodes, 1 members",
        "left out  1 EIGRL: choice of modes is left out; the case says how many (first at deck.bdf:",
        "supports  in force: spc_1; sets: spc_1, spc_2",
    ):
        assert line in text, line
    (groups,) = (line for line in text.splitlines() if line.startswith("groups"))
    assert groups.split()[1:] == ["pid_3,", "rbe2_60"]
    loose = describe(
        read(tmp_path, *bar(), "GRID,20,,9.,0.,0.", "CONM2,50,20,,3.", "CELAS2,9,5.,20,1", "PARAM,AUTOSPC,NO")
    )
    assert "mass      18.7 kg" in loose


# Readers


def test_a_deck_is_read_by_what_it_holds_where_its_suffix_is_of_another(tmp_path):
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
    with pytest.raises(ValueError, match=r"deck .*b.bdf does not exist; .* holds \['a.bdf'\]"):
        read_deck(tmp_path / "b.bdf")
    with pytest.raises(ValueError, match=r"b.nas does not exist; .* holds no such files"):
        read_deck(tmp_path / "b.nas")


def test_a_deck_that_makes_no_structure_is_described_up_to_what_stops_it(tmp_path):
    """Two masses on a rigid bar: no element has a stiffness. It is read, without supports of its own."""
    cards = ["GRID,1,,0.,0.,0.", "GRID,2,,2.,0.,0.", "CONM2,7,1,,3.", "CONM2,8,2,,5.", "RBE2,9,1,123456,2"]
    deck = read(tmp_path, *cards, "FORCE,1,1,,5.,1.", control="ECHO = NONE", units="mm-t-s")
    with pytest.raises(ValueError) as stop:
        deck.structure()
    assert describe(deck).splitlines() == [
        "deck.bdf: Nastran deck, read in mm-t-s (1 = 0.001 m, 1000 kg, 1 s)",
        f"stops     {stop.value}",
        "used      2 CONM2, 2 GRID, 1 RBE2",
        "left out  1 FORCE: loads and temperatures are left out; the case has them (first at deck.bdf:10)",
        "supports  in force: none; sets: none",
        "groups    rbe2_9",
    ]  # fmt: skip
    assert deck.default_supports == () and len(deck.point_masses) == 2
