"""Shells, solids with axes, connections and regions of a case are those of Python; mistakes are located."""

import numpy as np
import pytest

from femflex import fem, reduction
from femflex.case.problems import CaseError
from femflex.case.read import parse_case
from femflex.mesh import box, rectangle, write_mesh
from femflex.pipeline.decisions import build_system

CASE = """
[run]
duration = 0.1
output_step = 0.001
[materials.al]
E = "70 GPa"
nu = 0.3
density = 2700
[materials.fibre]
kind = "orthotropic"
E1 = "140 GPa"
E2 = "10 GPa"
G12 = "5 GPa"
nu12 = 0.3
density = 1600
{third}
[sections.sheet]
kind = "plate"
thickness = "8 mm"
[bodies.part]
kind = "flexible"
mesh = "part.msh"
members = [
  {{ group = "volume", family = "solid", material = "fibre", options = {{ axes = [0, 1, 0, 1, 0, 0] }} }},
  {{ group = "surface", family = "shell", section = "sheet", material = "al", options = {{ fold_angle = "30 deg" }} }},
]
connections = [
  {{ kind = "rigid", group = "right", reference = "hub point", position = ["1 m", "0.05 m", "0.05 m"] }},
  {{ kind = "{kind}", group = "frame", reference = "hub point 2", position = [1.2, 0.05, 0.05] }},
  {equation}
]
point_masses = [{{ group = "hub point 2", mass = "0.2 kg" }}]
reduction = {{ method = "cantilever", clamp = "{clamp}", modes = 3 }}
markers = {{ foot = {{ group = "{clamp}" }} }}
strain = "linear"
[bodies.part.regions]
foot = {{ box = [[-0.1, -1, -1], [0.001, 1, 1]], within = "volume" }}
edge = {{ nearest = [1.2, 0, 0.1] }}
frame = {{ box = [[1.19, -1, -1], [1.41, 1, 1]] }}
[[joints]]
kind = "weld"
child = "part"
child_marker = "foot"
"""
THIRD = 'E3 = "10 GPa"\nnu13 = 0.3\nnu23 = 0.4'
GEAR = '{ kind = "equation", terms = [{ group = "edge", component = "x", factor = 1.0 }, '
GEAR += '{ group = "hub point", component = "x", factor = -1.0 }] },'


def part():
    solid = box(1.0, 0.1, 0.1, 4, 1, 1, "hexahedron")
    sheet = rectangle(0.2, 0.1, 2, 2, "quad").rotated([np.pi / 2, 0, 0]).moved([1.2, 0.0, 0.0])
    return solid.merged(sheet)


def text(**changes):
    values = {"third": THIRD, "kind": "distributing", "equation": GEAR, "clamp": "foot"} | changes
    return CASE.format(**values)


def test_a_case_with_solids_shells_and_connections_is_that_of_python(tmp_path):
    mesh = part()
    write_mesh(tmp_path / "part.msh", mesh)
    body = build_system(parse_case(text(), tmp_path / "part.toml")).bodies["part"]
    hub, hub2 = np.array([1.0, 0.05, 0.05]), (1.2, 0.05, 0.05)
    frame = np.flatnonzero(mesh.points[:, 0] > 1.19)
    groups = {"frame": frame, "foot": np.flatnonzero(mesh.points[:, 0] < 1e-6)}
    mesh = mesh.with_groups(points={**groups, "edge": [mesh.nearest_point([1.2, 0, 0.1])]})
    fibre = fem.Orthotropic(140e9, 10e9, 10e9, 5e9, 5e9, 5e9, 0.3, 0.3, 0.4, 1600.0)
    structure = fem.build_structure(
        mesh,
        [
            fem.Member("volume", "solid", material=fibre, options={"axes": [0, 1, 0, 1, 0, 0]}),
            fem.Member("surface", "shell", 0.008, fem.Material(70e9, 0.3, 2700.0), {"fold_angle": np.radians(30)}),
        ],
        [fem.PointMass("second", 0.2)],
        connections=[
            fem.Rigid("right", tuple(hub), name="first"),
            fem.Distributing("frame", hub2, name="second"),
            fem.Equation((fem.Term("edge", "x", 1.0), fem.Term("first", "x", -1.0))),
        ],
    )
    expected = reduction.cantilever_modes(structure, ["foot"], 3).omega
    np.testing.assert_allclose(body.omega[: len(expected)], expected, rtol=1e-8)


@pytest.mark.parametrize(
    ("changes", "place", "found"),
    [
        ({"third": ""}, "materials.fibre", "without E3, nu13, nu23, which solids need"),
        ({"clamp": "fott"}, "clamp", "did you mean 'foot'"),
        ({"kind": "rigit"}, "connections", "rigit"),
        ({"equation": '{ kind = "rigid", group = "left" },'}, "connections", "reference"),
        ({"equation": GEAR.replace('"x"', '"u"', 1)}, "component", "'u'"),
        ({"equation": GEAR.replace('"edge"', '"nothing"')}, "connections[equation].terms", "no group"),
    ],
)
def test_mistakes_are_named_where_they_are(tmp_path, changes, place, found):
    write_mesh(tmp_path / "part.msh", part())
    with pytest.raises(CaseError) as error:
        build_system(parse_case(text(**changes), tmp_path / "part.toml"))
    assert place in str(error.value) and found in str(error.value)


def test_a_box_without_points_and_a_number_beyond_the_mesh_are_refused():
    from femflex.mesh.regions import with_box, with_points, with_whole

    mesh = part()
    with pytest.raises(ValueError, match=r"no point of group 'volume' lies in the box of region 'far'"):
        with_box(mesh, "far", [5, 5, 5], [6, 6, 6], "volume")
    with pytest.raises(ValueError, match="the mesh has points 1 to"):
        with_points(mesh, "far", [0])
    whole = with_whole(mesh, ["all", "all_surfaces", "all_lines", "other"])
    assert set(whole.cell_groups["all"]) == {"hexahedron"} and "quad" in whole.cell_groups["all_surfaces"]
    assert "other" not in whole.groups
    one = with_box(mesh, "end", [0.99, -1, -1], [1.01, 1, 1])
    assert len(one.point_groups["end"]) == 4 and len(one.cell_groups["end"]["quad"]) == 1


LAYUP = """
[run]
duration = 0.1
output_step = 0.001
[materials.fibre]
kind = "orthotropic"
E1 = "140 GPa"
E2 = "10 GPa"
G12 = "5 GPa"
nu12 = 0.3
density = 1600
[sections.crossed]
kind = "layup"
plies = [{{ material = "fibre", thickness = "1 mm" }}, {{ material = "fibre", thickness = "1 mm", angle = "90 deg" }}]
[bodies.part]
kind = "flexible"
mesh = "part.msh"
members = [{{ group = "surface", family = "{family}", section = "crossed" }}]
reduction = {{ method = "cantilever", clamp = "left", modes = 2 }}
strain = "linear"
[[joints]]
kind = "weld"
child = "part"
child_marker = "left"
"""


def test_a_shell_of_two_crossed_plies_bends_as_it_stretches_and_plates_refuse_it(tmp_path):
    """Narrow strip: EI_eff = b / d*_11 of the laminate's flexibility, of A, B and D together (classical lamination)."""
    length, width, t = 1.0, 0.05, 1e-3
    write_mesh(tmp_path / "part.msh", rectangle(length, width, 20, 1, "quad"))
    body = build_system(parse_case(LAYUP.format(family="shell"), tmp_path / "part.toml")).bodies["part"]
    d = 1.0 - 0.3**2 * 10 / 140
    Q = np.array([[140e9, 3e9, 0], [3e9, 10e9, 0], [0, 0, 5e9 * d]]) / d
    crossed = Q[[1, 0, 2]][:, [1, 0, 2]]
    A, B, D = (Q + crossed) * t, (crossed - Q) * t**2 / 2, (Q + crossed) * t**3 / 3
    soft = np.linalg.inv(np.block([[A, B], [B, D]]))
    exact = 1.8751**2 * np.sqrt(1.0 / soft[3, 3] / (1600 * 2 * t * length**4))
    assert D[0, 0] * soft[3, 3] > 1.3  # what B takes of the stiffness
    assert body.omega[0] == pytest.approx(exact, rel=5e-3)
    with pytest.raises(CaseError, match="lay-up of 2 plies is not symmetric"):
        build_system(parse_case(LAYUP.format(family="plate"), tmp_path / "part.toml"))
