"""Torques on solids, whose nodes do not turn: what a group of nodes makes of one, and where there is none to make."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femflex.advice import warn_of
from femflex.advice.bodies import KnownBodies
from femflex.advice.model_warnings import model_warnings
from femflex.case import read_case
from femflex.case.problems import CaseError
from femflex.dynamics.equilibria.equilibrium import equilibrium
from femflex.mesh import Mesh, box, write_mesh
from femflex.pipeline.case_bodies import build_body
from femflex.pipeline.decisions import build_system
from femflex.warning import PhysicsWarning

L, A, E = 2.0, 0.1, 1e9  # m, m, Pa; without Poisson's ratio a bar bends as a beam all through, clamped end and all
G, J = E / 2, 0.1405770 * A**4  # St Venant's constant of a square section
CASE = """
[run]
duration = "1 s"
output_step = 0.1

[materials.stuff]
E = 1e9
nu = 0.0
density = 1000

[bodies.bar]
kind = "flexible"
mesh = "bar.msh"
members = [{ group = "bar", family = "solid", material = "stuff" }]
reduction = { method = "cantilever", clamp = "root", modes = 2, loads = { tip = ["rx", "ry", "rz"] } }
strain = "linear"
markers = { tip = {}, near = {}, middle = {}, corner = {}, edge = {} }

[attitude]
held = true

[[loads]]
name = "twist"
body = "bar"
marker = "tip"
torque = [0, 0, 0]
"""


@pytest.fixture
def bar(tmp_path: Path):
    """The case of a bar under a torque at a marker, and its mesh in the same folder."""
    mesh = box(L, A, A, 10, 4, 4, cell="hexahedron27")
    points = mesh.points - [0.0, A / 2, A / 2]
    x, y, z = points.T
    at = {"root": 0.0, "near": L / 4, "middle": L / 2, "tip": L}
    groups = {name: np.flatnonzero(np.abs(x - place) < 1e-9) for name, place in at.items()}
    end = (np.abs(x - L) < 1e-9) & (y > A / 2 - 1e-9)
    groups |= {"edge": np.flatnonzero(end), "corner": np.flatnonzero(end & (z > A / 2 - 1e-9))}
    cells = {"hexahedron27": mesh.cells["hexahedron27"]}
    whole = {"bar": {"hexahedron27": np.arange(len(cells["hexahedron27"]))}}
    write_mesh(tmp_path / "bar.msh", Mesh(points, cells, whole, groups))

    def write(marker: str = "tip", torque: str = "[0, 0, 0]", more: str = "") -> Path:
        text = CASE.replace('marker = "tip"', f'marker = "{marker}"').replace(
            "torque = [0, 0, 0]", f"torque = {torque}"
        )
        (tmp_path / "bar.toml").write_text(text + more)
        return tmp_path / "bar.toml"

    return write


def turned(path: Path):
    """The equilibrium, and what each marker turns by (3,) in it."""
    found = equilibrium(build_system(read_case(path)))
    body = found.model.system.bodies["bar"]
    delta = found.q[-body.n_modes :]
    return body, delta, {name: marker.psi @ delta for name, marker in body.markers.items()}


@pytest.mark.sampled(1)
def test_a_torque_on_a_face_of_a_solid_bends_it_as_a_beam(bar):
    M = 3.0
    _, _, turn = turned(bar(torque=f"[0, {M}, {-M}]"))
    bent = M / (E * A**4 / 12)
    assert turn["near"] == pytest.approx([0.0, bent * L / 4, -bent * L / 4], rel=1e-5, abs=1e-9)
    assert turn["middle"] == pytest.approx([0.0, bent * L / 2, -bent * L / 2], rel=1e-5, abs=1e-9)
    assert turn["tip"][1] == pytest.approx(bent * L, rel=0.01)  # at its own nodes the load dents the end


@pytest.mark.slow
@pytest.mark.sampled(1)
def test_a_torque_on_a_face_of_a_solid_twists_it_as_saint_venant_has_it(bar):
    M = 3.0
    _, _, turn = turned(bar(torque=f"[{M}, 0, 0]"))
    assert turn["middle"][0] - turn["near"][0] == pytest.approx(M * L / 4 / (G * J), rel=2e-3)  # four elements across


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("marker", "torque"), [("tip", (1.0, -2.0, 3.0)), ("edge", (1.0, 2.0, 0.0))])
def test_the_work_of_a_torque_is_the_energy_it_stores(bar, marker: str, torque: tuple[float, float, float]):
    path = bar(marker, str(list(torque)))
    path.write_text(path.read_text().replace("loads = { tip =", f"loads = {{ {marker} ="))
    if marker == "edge":
        path.write_text(path.read_text().replace('["rx", "ry", "rz"]', '["rx", "ry"]'))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "marker 'edge' shows no rotation about 1 of 3 axes", PhysicsWarning)
        body, delta, turn = turned(path)
    assert body.strain.energy(delta) == pytest.approx(np.dot(torque, turn[marker]) / 2, rel=1e-9)


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("marker", "torque", "frame", "told"),
    [
        ("corner", "[0, 2, 0]", "body", "found 2 N m at marker 'corner' of body 'bar', which shows no rotation:"),
        ("corner", "[0, 2, 0]", "inertial", "found 2 N m at marker 'corner' of body 'bar', which shows no rotation:"),
        ("corner", "[[0, 0, 0], [3, 4, 0]]", "body", "found 5 N m at marker 'corner'"),
        ("edge", "[0, 4, 3]", "body", "found 3 N m at marker 'edge' .* shows no rotation about \\[0, 0, 1\\]:"),
    ],
)
def test_a_torque_that_would_bend_nothing_is_refused(bar, marker: str, torque: str, frame: str, told: str):
    times = "times = [0, 1]\n" if torque.startswith("[[") else ""
    with pytest.raises(CaseError, match=rf"loads\[twist\]\.torque: {told}.* Name a group of several nodes"):
        build_system(read_case(bar(marker, torque, f'frame = "{frame}"\n{times}')))


def test_a_torque_in_the_axes_of_a_turned_marker_is_judged_in_those_of_the_body(bar):
    """x, y and z of the marker are y, z and x of the body: of (2, 3, 4) N m the 3 are about the line of nodes."""
    path = bar("edge", "[2, 3, 4]", 'frame = "marker"\n')
    turned = "edge = { orientation = [[0, 0, 1], [1, 0, 0], [0, 1, 0]] } }"
    path.write_text(path.read_text().replace("edge = {} }", turned))
    with pytest.raises(CaseError, match=r"found 3 N m at marker 'edge' .* shows no rotation about \[0, 0, 1\]:"):
        build_system(read_case(path))


@pytest.mark.slow
@pytest.mark.sampled(1)
def test_a_torque_across_a_line_of_nodes_acts(bar):
    with pytest.warns(PhysicsWarning, match="marker 'edge' shows no rotation about 1 of 3 axes"):
        build_system(read_case(bar("edge", "[0, 2, 0]")))


@pytest.mark.slow
def test_a_torque_on_a_body_whose_shapes_do_not_turn_its_marker_is_told_of(bar):
    body = build_body(read_case(bar()), "bar")
    system = build_system(read_case(bar(torque="[1, 0, 0]")))
    tip = body.markers["tip"]
    still = replace(body, markers={**body.markers, "tip": replace(tip, psi=0.0 * tip.psi)})
    with pytest.warns(
        PhysicsWarning, match=r"loads\[twist\]: none of the 5 shapes of body 'bar' rotates its marker 'tip'"
    ):
        warn_of(model_warnings(replace(system, bodies={"bar": still}), KnownBodies({}), 1.0))
