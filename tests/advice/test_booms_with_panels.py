"""A boom with a thin panel at its end, sagging by 8 % of its length: against Newton's method on the whole structure."""

import warnings
from functools import cache

import numpy as np
import pytest
import scipy.sparse.linalg as sla

import femflex
from femflex.assembly import build_mesh, build_structure_of
from femflex.case.read import parse_case
from femflex.mesh import Mesh, write_mesh
from femflex.reduction.boundary.rigid import free_dofs, held_dofs

GRAVITY = 1.6
CRAFT = """
[run]
duration = 1.0
[environment]
gravity = {gravity}
[materials.al]
E = "70 GPa"
nu = 0.33
density = 2700
[sections.tube]
kind = "tube"
outer_radius = "25 mm"
thickness = "1 mm"
[sections.sheet]
kind = "plate"
thickness = "3 mm"
[bodies.wing]
kind = "flexible"
mesh = "wing.msh"
members = [
  {{ group = "boom", family = "beam", section = "tube", material = "al" }},
  {{ group = "panel", family = "plate", section = "sheet", material = "al" }},
]
reduction = {{ method = "cantilever", clamp = "root", modes = {modes} }}
strain = "condensed"
markers = {{ root = {{}}, corner = {{}} }}
[[joints]]
kind = "weld"
child = "wing"
child_marker = "root"
"""


def wing():
    """A boom of 4 m along x that runs on by 0.5 m along the middle line of a panel of 2 m x 1 m."""
    x, y = np.meshgrid(np.linspace(4, 6, 9), np.linspace(-0.5, 0.5, 5), indexing="ij")
    boom = np.column_stack([np.linspace(0, 3.5, 8), np.zeros((8, 2))])
    points = np.vstack([boom, np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])])
    number = 8 + np.arange(x.size).reshape(x.shape)
    a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    triangles = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    nodes = [*range(8), *number[:3, 2]]
    lines = np.column_stack([nodes[:-1], nodes[1:]])
    groups = {"boom": {"line": np.arange(len(lines))}, "panel": {"triangle": np.arange(len(triangles))}}
    points_of_group = {"root": np.array([0]), "corner": np.array([number[-1, -1]])}
    return Mesh(points, {"line": lines, "triangle": triangles}, groups, points_of_group)


def case_in(folder, modes=16, gravity=GRAVITY):
    write_mesh(folder / "wing.msh", wing())
    return parse_case(CRAFT.format(modes=modes, gravity=gravity), folder / "wing.toml")


@cache
def sag(folder, gravity=GRAVITY):
    """Sag of the panel's corner [m] by Newton's method on all dofs."""
    case = case_in(folder)
    table = case.bodies["wing"]
    structure = build_structure_of(case, "wing", table, build_mesh(case, "wing", table))
    free = free_dofs(structure, held_dofs(structure, ["root"]))
    points = structure.mesh.points
    up = np.linalg.lstsq(structure.translation.toarray(), np.tile([0.0, 0.0, 1.0], len(points)), rcond=None)[0]
    load, x = -gravity * (structure.M @ up), np.zeros(structure.n_dof)
    for part in (0.5, 1.0):
        for _ in range(40):
            rest = (part * load - structure.internal_force.force(x))[free]
            step = sla.spsolve(structure.internal_force.tangent(x).tocsc()[free][:, free], rest)
            x[free] += step
            if np.abs(step).max() < 1e-7 * np.abs(x).max():
                break
        else:
            raise AssertionError("the static state was not found")
    corner = structure.mesh.group_points("corner")[0]
    return -(structure.translation @ x).reshape(-1, 3)[corner, 2]


@pytest.mark.slow
@pytest.mark.parametrize(("modes", "gravity", "within"), [(8, 0.6, 5e-3), (16, 1.6, 2e-2)])
def test_sag_of_boom_with_panel_matches_full_structure(tmp_path, modes, gravity, within):
    """With the pull along the boom as a coordinate, sixteen modes sagged 19 % too little where eight were 2 % short."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of bends beyond what linear strain holds
        state = femflex.equilibrium(femflex.build_system(case_in(tmp_path, modes, gravity)))
    w = -state.model.observe(np.zeros(1), state.x[None])["markers/wing.corner/deflection"][0, 2]
    assert w == pytest.approx(sag(tmp_path, gravity), rel=within)
