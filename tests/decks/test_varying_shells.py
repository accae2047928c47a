"""Shells of decks whose thickness and axes vary from corner to corner and from element to element."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.nastran_decks import read

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


def test_corner_thickness_of_cquad4_is_the_taper_that_a_formula_gives(tmp_path):
    grids, quads = strip()
    deck = read(tmp_path, *grids, *quads, "PSHELL,3,1,.02,1,,1", MAT1, "SPC1,1,123456,1,101")
    structure = deck.structure()
    assert len(deck.members) == 1 and not [one for one in deck.unused if "T1" in one.card]
    assert mass_and_centre(structure)[0] == pytest.approx(2700 * L * W * 0.015, rel=1e-9)
    assert hertz(structure, deck.held()) == pytest.approx(by_formula(rectangle(L, W, N, 1, "quad")), rel=1e-7)


def test_a_refined_deck_keeps_its_taper(tmp_path):
    grids, quads = strip()
    deck = read(tmp_path, *grids, *quads, "PSHELL,3,1,.02,1,,1", MAT1, "SPC1,1,123456,1,101")
    mesh = deck.mesh.refined(2)
    structure = build_structure(mesh, refined_members(mesh, deck.members), supports=deck.held())
    assert mass_and_centre(structure)[0] == pytest.approx(2700 * L * W * 0.015, rel=1e-9)
    finer = by_formula(rectangle(L, W, 4 * N, 4, "quad"))
    assert hertz(structure, deck.held()) == pytest.approx(finer, rel=1e-7)


def test_thickness_at_nodes_of_an_abaqus_deck_is_the_same_taper(tmp_path):
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
    assert hertz(deck.structure(), deck.held()) == pytest.approx(by_formula(rectangle(L, W, N, 1, "quad")), rel=1e-7)


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
    deck = read(folder, *grids, *quads, *cards)
    assert len(deck.members) == 1
    return hertz(deck.structure(), deck.held())


def test_material_axes_of_elements_stand_in_one_member(tmp_path):
    assert laminate(tmp_path, True) == pytest.approx(laminate(tmp_path, False), rel=1e-7)
