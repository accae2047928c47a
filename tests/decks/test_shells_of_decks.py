"""Shells of decks: varying thickness and axes of elements, and plies about the normals of triangles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.nastran_decks import frequencies, read_deck_of_cards

from femflex.assembly.decks import refined_members
from femflex.decks import read_deck
from femflex.decks.report import mass_and_centre
from femflex.fem import Material, Member, build_structure
from femflex.mesh import Mesh, rectangle
from femflex.reduction import cantilever_modes

L, W, N = 1.0, 0.1, 8
TAPER = "0.02 * (1 - 0.5 * x)"  # from 20 mm to 10 mm
METAL = Material(70e9, 0.3, 2700.0)
MAT1 = "MAT1,1,7.E10,,.3,2700."


def taper(x: float) -> float:
    return 0.02 * (1 - 0.5 * x)


def strip() -> tuple[list[str], list[str]]:
    """GRID cards of a strip, numbered along both edges, and its CQUAD4 cards with their own corner thickness."""
    grids = [f"GRID,{k + 1 + 100 * j},,{L * k / N:.6f},{W * j},0." for j in (0, 1) for k in range(N + 1)]
    quads = []
    for k in range(N):
        a, b = taper(L * k / N), taper(L * (k + 1) / N)
        quads += [f"CQUAD4,{k + 1},3,{k + 1},{k + 2},{k + 102},{k + 101}", f",,,{a:.8f},{b:.8f},{b:.8f},{a:.8f}"]
    return grids, quads


def hertz(structure, held) -> np.ndarray:
    return np.asarray(cantilever_modes(structure, held, 4).omega[:4]) / (2 * np.pi)


def by_formula(mesh: Mesh) -> np.ndarray:
    """Frequencies of the same strip by a formula of its thickness."""
    member = Member("surface", "shell", 0.02, METAL, {"thickness": TAPER})
    return hertz(build_structure(mesh, [member]), {"left": ("x", "y", "z", "rx", "ry", "rz")})


def test_corner_thickness_of_cquad4_is_a_taper(tmp_path):
    grids, quads = strip()
    deck = read_deck_of_cards(tmp_path, *grids, *quads, "PSHELL,3,1,.02,1,,1", MAT1, "SPC1,1,123456,1,101")
    structure = deck.structure()
    assert len(deck.members) == 1 and not [card for card in deck.unused if "T1" in card.card]
    assert mass_and_centre(structure)[0] == pytest.approx(2700 * L * W * 0.015, rel=1e-9)
    assert hertz(structure, deck.active_supports()) == pytest.approx(
        by_formula(rectangle(L, W, N, 1, "quad")), rel=1e-7
    )


def test_refined_deck_keeps_its_taper(tmp_path):
    grids, quads = strip()
    deck = read_deck_of_cards(tmp_path, *grids, *quads, "PSHELL,3,1,.02,1,,1", MAT1, "SPC1,1,123456,1,101")
    mesh = deck.mesh.refined(2)
    structure = build_structure(mesh, refined_members(mesh, deck.members), supports=deck.active_supports())
    assert mass_and_centre(structure)[0] == pytest.approx(2700 * L * W * 0.015, rel=1e-9)
    finer = by_formula(rectangle(L, W, 4 * N, 4, "quad"))
    assert hertz(structure, deck.active_supports()) == pytest.approx(finer, rel=1e-7)


def test_nodal_thickness_of_abaqus_is_a_taper(tmp_path):
    grids, _ = strip()
    nodes = [",".join((words := card.split(","))[1:2] + words[3:]) for card in grids]
    quads = [f"{k + 1},{k + 1},{k + 2},{k + 102},{k + 101}" for k in range(N)]
    at = [f"{number},{taper(L * k / N):.8f}" for k in range(N + 1) for number in (k + 1, k + 101)]
    path = tmp_path / "strip.inp"
    path.write_text(
        "\n".join([
            "*HEADING", "*NODE", *nodes, "*ELEMENT, TYPE=S4, ELSET=STRIP", *quads, "*MATERIAL, NAME=METAL", "*ELASTIC",
            "7.E10,.3", "*DENSITY", "2700.", "*SHELL SECTION, ELSET=STRIP, MATERIAL=METAL, NODAL THICKNESS", ".02",
            "*NODAL THICKNESS", *at, "*BOUNDARY", "1,1,6", "101,1,6", "",
        ])
    )  # fmt: skip
    deck = read_deck(path)
    assert len(deck.members) == 1
    assert hertz(deck.structure(), deck.active_supports()) == pytest.approx(
        by_formula(rectangle(L, W, N, 1, "quad")), rel=1e-7
    )


def laminate(folder: Path, turned: bool) -> np.ndarray:
    """Frequencies of a strip of one ply along x; every second element may be numbered from its next corner."""
    grids, _ = strip()
    quads = []
    for k in range(N):
        corners = [k + 1, k + 2, k + 102, k + 101]
        theta = 30.0
        if turned and k % 2:
            corners, theta = corners[1:] + corners[:1], theta - 90.0
        quads.append(f"CQUAD4,{k + 1},3,{','.join(map(str, corners))},{theta}")
    cards = ["MAT8,1,1.4E11,1.E10,.3,5.E9,5.E9,5.E9,1600.", "PCOMP,3", ",1,.002,0.", "SPC1,1,123456,1,101"]
    deck = read_deck_of_cards(folder, *grids, *quads, *cards)
    assert len(deck.members) == 1
    return hertz(deck.structure(), deck.active_supports())


def test_material_axes_of_elements(tmp_path):
    assert laminate(tmp_path, True) == pytest.approx(laminate(tmp_path, False), rel=1e-7)


def facets(down: bool, properties: list[str]) -> list[str]:
    """A plate of 16 triangles, 1 m by 0.5 m, whose normals are +z, or -z; its ply axis lies at 30 deg."""
    axis = "CORD2R,9,,0.,0.,0.,0.,0.,1.\n,0.86602540,.5,0."
    nodes = [f"GRID,{1 + i + 5 * j},,{i / 4},{j / 4},0." for j in range(3) for i in range(5)]
    cells = []
    for j in range(2):
        for i in range(4):
            a = 1 + i + 5 * j
            for corners in ((a, a + 1, a + 6), (a, a + 6, a + 5)):
                own = corners[::-1] if down else corners
                cells.append(f"CTRIA3,{len(cells) + 1},3,{own[0]},{own[1]},{own[2]},9")
    return [*nodes, *cells, axis, *properties, "SPC1,1,123456,1,6,11"]


PLIES = {  # by sense of the normal: angles count about it
    False: ["PCOMP,3,,,,,,,SYM\n,8,1.-3,0.,,8,1.-3,45.", "MAT8,8,1.4+11,1.+10,.3,5.+9,5.+9,3.+9,1600."],
    True: ["PCOMP,3,,,,,,,SYM\n,8,1.-3,0.,,8,1.-3,-45.", "MAT8,8,1.4+11,1.+10,.3,5.+9,5.+9,3.+9,1600."],
}


def test_ply_angles_count_about_the_normal_of_triangles(tmp_path):
    up = read_deck_of_cards(tmp_path, *facets(False, PLIES[False]))
    assert {member.family for member in up.members} == {"plate"}
    turned = frequencies(read_deck_of_cards(tmp_path, *facets(True, PLIES[True])))  # seen from above both have +45 deg
    assert turned == pytest.approx(frequencies(up), rel=1e-9)
    mirrored = frequencies(read_deck_of_cards(tmp_path, *facets(True, PLIES[False])))
    assert abs(mirrored[0] / turned[0] - 1) > 0.05


def test_relative_thickness_of_second_order_shells(tmp_path):
    """TFLAG = 1: T1 to T4 times the property's thickness."""
    x = [(0, 0), (1, 0), (1, 0.5), (0, 0.5), (0.5, 0), (1, 0.25), (0.5, 0.5), (0, 0.25)]
    grids = [f"GRID,{k + 1},,{a},{b},0." for k, (a, b) in enumerate(x)]
    last = ["PSHELL,3,1,.02,1,,1", "MAT1,1,7.E10,,.3,2700.", "SPC1,1,123456,1,4,8"]
    quad = ["CQUAD8,1,3,1,2,3,4,5,6", ",7,8,2.,2.,2.,2.,,", ",1"]
    assert mass_and_centre(read_deck_of_cards(tmp_path, *grids, *quad, *last).structure())[0] == pytest.approx(
        2700 * 0.5 * 0.04
    )
    tria = ["CTRIA6,1,3,1,2,4,5,9,8", ",,,2.,2.,2.,1", "GRID,9,,.5,.25,0."]
    own = [card for card in grids if card.split(",")[1] in "12458"]
    imported = read_deck_of_cards(tmp_path, *own, *tria, *last[:2], "SPC1,1,123456,1,4,8")
    assert mass_and_centre(imported.structure())[0] == pytest.approx(2700 * 0.25 * 0.04)
