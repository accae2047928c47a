"""Initial shapes of bodies by hand; meshes in wrong units; problems of bodies and loads that are reported together."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from femflex.assembly import build_part
from femflex.assembly.extents import warn_of_doubtful_extents
from femflex.assembly.initial import initial_shape
from femflex.assembly.structures import with_static_derivatives
from femflex.assembly.system import bodies_and_loads, problems_of_loads
from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors
from femflex.case import parse_case, read_case
from femflex.case.body import FlexibleTable
from femflex.case.initial import InitialTable
from femflex.case.problems import CaseError
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import Mesh
from femflex.mesh.generators import line
from femflex.reduction import cantilever_modes
from femflex.warning import PhysicsWarning

K = np.array([[5.0, 1.0, 0.0, 0.0], [1.0, 7.0, 2.0, 0.0], [0.0, 2.0, 11.0, 0.0], [0.0, 0.0, 0.0, 13.0]])
PHI = np.array([[0.5, -0.2, 0.1, 9.0], [0.1, 0.3, -0.4, 9.0], [0.2, 0.2, 0.6, 9.0]])  # at the tip
AXES = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # its x is the body's y
JOINT = np.array([1.0, 0.0, 2.0])


def springs(phi=PHI) -> FlexibleBody:
    """Four coordinates, the last a modal derivative, and a marker 3 m from the joint."""
    moments = MassMoments(1.0, np.zeros((5, 3)), np.zeros((5, 3, 5, 3)))
    tip = Marker(JOINT + np.array([2.0, 1.0, -2.0]), phi, 0.0 * phi, AXES)
    kinds = ("vibration", "vibration", "vibration", "derivative")
    return FlexibleBody(moments, StrainTensors.linear(K), np.zeros((4, 4)), {"tip": tip}, kinds=kinds)


def start(phi=PHI, **table):
    return initial_shape(InitialTable(**table), springs(phi), JOINT)


def test_amplitudes_and_rates_fill_the_first_coordinates():
    delta, rates = start(amplitudes=[0.1, -0.2], rates=[0.3])
    assert delta.tolist() == [0.1, -0.2, 0.0, 0.0] and rates.tolist() == [0.3, 0.0, 0.0, 0.0]
    delta, rates = start(rates=[1.0, 2.0, 3.0, 4.0])
    assert not delta.any() and rates.tolist() == [1.0, 2.0, 3.0, 4.0]
    with pytest.raises(ValueError, match=r"^found 5 amplitudes; the body has 4 elastic coordinates$"):
        start(amplitudes=[1.0] * 5)
    with pytest.raises(ValueError, match=r"^found 6 rates; the body has 4 elastic coordinates$"):
        start(rates=[1.0] * 6)


def test_a_displacement_is_met_by_as_few_of_the_lowest_modes_as_reach_it_or_by_those_named():
    along = AXES @ np.array([0.3, 0.1, -0.2])
    delta, rates = start(marker="tip", displacement=[0.3, 0.1, -0.2], rates=[0.5])
    assert PHI[:, :3] @ delta[:3] == pytest.approx(along) and delta[3] == 0.0 and rates[0] == 0.5
    two = AXES.T @ (0.02 * PHI[:, 0] - 0.03 * PHI[:, 1])
    assert start(marker="tip", displacement=two.tolist())[0] == pytest.approx(np.array([0.02, -0.03, 0, 0]))
    own = AXES.T @ (0.02 * PHI[:, 2] - 0.03 * PHI[:, 0])
    found = start(marker="tip", displacement=own.tolist(), modes=[3, 1])[0]
    assert found == pytest.approx(np.array([-0.03, 0.0, 0.02, 0.0]), abs=1e-12)
    far = start(marker="tip", relative=(own / 3.0).tolist(), modes=[1, 3])[0]
    assert far == pytest.approx(found, abs=1e-12)  # of the 3 m from its joint
    half = start(marker="tip", relative=(own / 3.0).tolist(), length=1.5, modes=[1, 3])[0]
    assert half == pytest.approx(found / 2, abs=1e-12)
    with pytest.raises(ValueError, match=r"^found mode 4; the body has 3$"):
        start(marker="tip", displacement=[1, 0, 0], modes=[1, 4])


def test_a_static_shape_is_that_of_least_energy():
    """delta = K^-1 phi^T (phi K^-1 phi^T)^-1 u over the shapes that are no derivatives."""
    flat = PHI.copy()
    flat[0, :3] = 0.0  # nothing moves along x: two equations for three coordinates
    wanted = np.array([0.0, 0.3, -0.2])
    delta, _ = start(flat, marker="tip", displacement=(AXES.T @ wanted).tolist(), shape="static")
    R = flat[1:, :3]
    C = np.linalg.inv(K[:3, :3])
    assert delta == pytest.approx(np.append(C @ R.T @ np.linalg.solve(R @ C @ R.T, wanted[1:]), 0.0))


def test_a_displacement_that_is_not_reached_is_said_with_what_is():
    flat = PHI.copy()
    flat[0, :3] = 0.0
    best = np.linalg.lstsq(flat[:, :3], np.array([0.25, 0.5, 0.0]), rcond=None)[0]
    assert flat[:, :3] @ best == pytest.approx([0.0, 0.5, 0.0])
    text = (
        r"^marker 'tip': the requested initial displacement is \[0\.25, 0\.5, 0\] m \(body axes\), and {} give at most "
        r"\[0, 0\.5, 0\] m; give a displacement in a direction in which the body bends, or keep more modes$"
    )
    asked = {"marker": "tip", "displacement": [0.5, -0.25, 0.0]}
    with pytest.raises(ValueError, match=text.format("its 3 modes")):
        start(flat, **asked)
    with pytest.raises(ValueError, match=text.format("a static force there")):
        start(flat, **asked, shape="static")


# --- meshes in wrong units --------------------------------------------------------------------------------------------


def doubts(size: float, family: str = "beam", mass: float = 12.0, **keys) -> list[str]:
    """Warnings of a body whose box spans that size along y and less elsewhere."""
    section = {"section": "wall"} if family == "plate" else {}
    table = {
        "kind": "flexible",
        "mesh": "a.msh",
        "members": [{"group": "g", "family": family, **section}],
        "reduction": {"method": "free_free", "modes": 3},
        **keys,
    }
    points = np.array([[0.0, 0.1, 0.0], [size / 2, 0.1 + size, 0.0], [0.1 * size, 0.1, 0.3 * size]])
    mesh = Mesh(points, {"triangle": np.array([[0, 1, 2]])})
    case = parse_case(
        "[run]\nduration = 1\n[bodies.b]\nkind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n"
        "[sections.wall]\nkind = 'plate'\nthickness = 2\n"
    )
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        warn_of_doubtful_extents(case, "b", FlexibleTable.model_validate(table), mesh, mass)
    assert all(one.category is PhysicsWarning for one in given)
    return [str(one.message) for one in given]


def test_meshes_far_too_large_are_doubted_unless_their_unit_is_said():
    said = (
        "bodies.b: the mesh spans {} m, over {} m, and its mass is 12 kg; if its unit is millimetres, set mesh_unit = "
        "'mm', and if it is metres, mesh_unit = 'm'"
    )
    assert doubts(201.0) == [said.format("201", "200")] and doubts(199.0) == []
    assert doubts(201.0, mesh_unit="m") == [] and doubts(1.99e5, "tether") == []
    assert doubts(2.01e5, "tether") == [said.format("2.01e+05", "200000")]
    assert doubts(0.06) == [] and doubts(0.04) == []  # in metres as it is by itself


def test_sections_too_thick_for_their_mesh_are_doubted():
    assert doubts(8.1, "plate") == []
    assert doubts(7.9, "plate") == [
        "sections.wall.thickness: found 2 m in a mesh that spans 7.9 m, too thick for a plate; if millimetres were "
        'meant, write "2 mm" (0.002 m)'
    ]
    assert doubts(7.9) == []


@pytest.mark.parametrize("radius", ["0.3 mm", "60 mm"])  # drawn, the second is over 5 cm across
@pytest.mark.parametrize(("unit", "per_metre"), [("mm", 1000), ("cm", 100)])
def test_a_small_mesh_that_is_read_in_another_unit_may_be_in_metres(craft, write_case, unit, per_metre, radius):
    thin = craft.replace("30 mm", radius).replace("2 mm", "0.1 mm")
    case = read_case(write_case(thin.replace('mesh = "boom.inp"', f'mesh = "boom.inp"\nmesh_unit = "{unit}"')))
    spans = f"{3 / per_metre:g}"
    with pytest.warns(PhysicsWarning) as given:
        build_part(case, "boom")
    assert [str(one.message) for one in given if "mesh spans" in str(one.message)] == [
        f"bodies.boom: the mesh spans {spans} m, read in {unit}; if its unit is metres, it spans 3 m: "
        "leave out mesh_unit"
    ]


# --- reported together ------------------------------------------------------------------------------------------------

CASE = """
[run]
duration = 1
[bodies.a]
kind = "file"
file = "a.h5"
[bodies.b]
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[joints]]
kind = "weld"
parent = "b"
child = "a"
child_marker = "tip"
[[loads]]
name = "push"
body = "b"
table = "push.csv"
"""


def test_problems_of_bodies_and_of_loads_come_together(tmp_path):
    """Two files that hold something else."""
    for name in ("a.h5", "push.csv"):
        (tmp_path / name).write_text("t, nothing\nof, use\n")
    case = parse_case(CASE, tmp_path / "case.toml")

    def problems(case, bodies):
        with pytest.raises(CaseError) as found:
            bodies_and_loads(case, bodies)
        assert str(found.value).startswith("case.toml: ")
        return [problem.where for problem in found.value.problems]

    both = problems(case, None)
    assert len(both) == 2 and both[0].startswith("bodies.a") and both[1].startswith("loads[push]")
    given = {"a": springs()}
    assert problems(case, given) == both[1:] == [one.where for one in problems_of_loads(case)]
    fine = parse_case(CASE.replace('table = "push.csv"', "force = [1, 0, 0]"), tmp_path / "case.toml")
    parts, loads = bodies_and_loads(fine, given)
    assert parts == given and [load.name for load in loads] == ["push"] and problems_of_loads(fine) == []
    assert problems(fine, None) == both[:1]


def test_fewer_derivatives_than_requested_are_warned_of_with_both_numbers():
    """One shape has one pair with itself."""
    member = Member("line", "beam", Rectangle(0.02, 0.005), Material(7e10, 0.3, 2700.0), {"orientation": (0, 0, 1)})
    structure = build_structure(line([[0, 0, 0], [0.4, 0.3, 0.1], [1, 0, 0.3]], 2), [member])
    modes = cantilever_modes(structure, "start", 1)
    with pytest.warns(PhysicsWarning) as given:
        found = with_static_derivatives(structure, modes, 3, None, "bodies.b")
    assert found.n_modes == 2
    assert [str(one.message) for one in given] == [
        "bodies.b: 3 derivatives are requested, but the pairs of its 1 shapes give only 1 independent ones. These are "
        "used; set derivatives = 1"
    ]
    for keep in (1, "all", "auto"):
        assert with_static_derivatives(structure, modes, keep, None, "bodies.b").n_modes == 2
