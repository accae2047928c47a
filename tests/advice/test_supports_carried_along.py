"""A joint at one of several supports that its clamp leaves free to turn drags the other supports along."""

import numpy as np
import pytest

from femflex.case.read import parse_case
from femflex.mesh import Mesh, write_mesh
from femflex.pipeline.decisions import build_system
from femflex.warning import PhysicsWarning

BEAM = """
[run]
duration = 0.1
output_step = 0.001
[materials.al]
E = "70 GPa"
nu = 0.3
density = 2700
[sections.bar]
kind = "rectangle"
width = "20 mm"
height = "8 mm"
[bodies.beam]
kind = "flexible"
mesh = "beam.msh"
members = [{{ group = "bar", family = "beam", section = "bar", material = "al" }}]
reduction = {{ method = "cantilever", clamp = {clamp}, modes = 2 }}
markers = {{ left = {{}}, right = {{}} }}
strain = "linear"
[[joints]]
kind = "weld"
child = "beam"
{held}
"""
HINGED = '{ left = ["x", "y", "z", "rx", "rz"], right = ["x", "y", "z", "rx", "rz"] }'


def build(folder, clamp, held):
    x = np.linspace(0, 1, 9)
    cells = {"line": np.column_stack([np.arange(8), np.arange(1, 9)])}
    places = {"left": np.array([0]), "right": np.array([8])}
    points = np.column_stack([x, np.zeros((9, 2))])
    write_mesh(folder / "beam.msh", Mesh(points, cells, {"bar": {"line": np.arange(8)}}, places))
    case = parse_case(BEAM.format(clamp=clamp, held=held), folder / "beam.toml")
    build_system(case)


def test_a_weld_at_a_support_that_turns_in_the_shapes_is_told_of(tmp_path):
    with pytest.warns(PhysicsWarning, match=r"'left', whose clamp leaves ry free.*\('right'\).*Remove child_marker"):
        build(tmp_path, HINGED, 'child_marker = "left"')


@pytest.mark.parametrize(
    ("clamp", "held"),
    [
        (HINGED, ""),
        ('["left", "right"]', 'child_marker = "left"'),
        ('{ left = ["x", "y", "z", "rx", "ry", "rz"], right = ["z"] }', 'child_marker = "left"'),
    ],
)
def test_a_body_held_where_its_supports_are_still_is_not(tmp_path, clamp, held, recwarn):
    build(tmp_path, clamp, held)
    assert not [one for one in recwarn if "drags" in str(one.message)]
