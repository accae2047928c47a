"""Supports of a case in axes of their own hold what they hold in Python."""

import numpy as np
import pytest

from femflex import fem, reduction
from femflex.case.read import parse_case
from femflex.fem.support import Support, antisymmetry, symmetry
from femflex.mesh import Mesh, read_mesh, rectangle, write_mesh
from femflex.pipeline.decisions import build_system

CASE = """
[run]
duration = 0.1
output_step = 0.001
[materials.al]
E = "70 GPa"
nu = 0.3
density = 2700
[sections.sheet]
kind = "plate"
thickness = "8 mm"
[bodies.dome]
kind = "flexible"
mesh = "dome.msh"
members = [{{ group = "surface", family = "plate", section = "sheet", material = "al" }}]
reduction = {{ method = "cantilever", clamp = {clamp}, modes = 3 }}
markers = {{ right = {{}} }}
strain = "linear"
[[joints]]
kind = "weld"
child = "dome"
child_marker = "right"
"""
CLAMP = '{ right = ["x", "y", "z", "rx", "ry", "rz"], left = %s }'
SKEW = ((0.8, 0.6, 0.0), (-0.6, 0.8, 0.0), (0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("text", "support"),
    [
        ("{ symmetry = [0.8, 0.6, 0.0] }", symmetry(SKEW[0])),
        ("{ antisymmetry = [4, 3, 0] }", antisymmetry(SKEW[0])),
        (
            '{ components = ["x", "ry"], axes = [[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]] }',
            Support(("x", "ry"), SKEW),
        ),
    ],
)
def test_a_case_holds_a_skew_edge_as_python_does(tmp_path, text, support):
    flat = rectangle(1.0, 0.8, 4, 3)
    x, y, _ = flat.points.T
    dome = Mesh(np.stack([x, y, -0.3 * x**2 - 0.2 * y**2], axis=1), flat.cells, flat.cell_groups)
    write_mesh(tmp_path / "dome.msh", dome.rotated(np.array(SKEW).T))
    body = build_system(parse_case(CASE.format(clamp=CLAMP % text), tmp_path / "dome.toml")).bodies["dome"]
    supports = {"right": ("x", "y", "z", "rx", "ry", "rz"), "left": support}
    members = [fem.Member("surface", "plate", 0.008, fem.Material(70e9, 0.3, 2700.0))]
    structure = fem.build_structure(read_mesh(tmp_path / "dome.msh"), members, supports=supports)
    expected = reduction.cantilever_modes(structure, supports, 3).omega
    np.testing.assert_allclose(body.omega[: len(expected)], expected, rtol=1e-9)
