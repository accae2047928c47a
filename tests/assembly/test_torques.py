"""Torques on solids, whose nodes do not turn: what a group of nodes makes of one, and where there is none to make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femflex.case import read_case
from femflex.linear.equilibrium import equilibrium
from femflex.mesh import Mesh, box, write_mesh
from femflex.pipeline.decisions import build_system

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


def equilibrium_rotations(path: Path):
    """The body, its equilibrium, and the rotation (3,) of each marker in it."""
    found = equilibrium(build_system(read_case(path)))
    body = found.model.system.bodies["bar"]
    delta = found.q[-body.n_modes :]
    return body, delta, {name: marker.psi @ delta for name, marker in body.markers.items()}


@pytest.mark.slow
@pytest.mark.sampled(1)
def test_torque_on_face_of_solid_bends_like_a_beam(bar):
    M = 3.0
    _, _, turn = equilibrium_rotations(bar(torque=f"[0, {M}, {-M}]"))
    bent = M / (E * A**4 / 12)
    assert turn["near"] == pytest.approx([0.0, bent * L / 4, -bent * L / 4], rel=1e-5, abs=1e-9)
    assert turn["middle"] == pytest.approx([0.0, bent * L / 2, -bent * L / 2], rel=1e-5, abs=1e-9)
    assert turn["tip"][1] == pytest.approx(bent * L, rel=0.01)  # at its own nodes the load dents the end


@pytest.mark.slow
@pytest.mark.sampled(1)
def test_torque_on_face_of_solid_twists_like_saint_venant(bar):
    M = 3.0
    _, _, turn = equilibrium_rotations(bar(torque=f"[{M}, 0, 0]"))
    assert turn["middle"][0] - turn["near"][0] == pytest.approx(M * L / 4 / (G * J), rel=2e-3)  # four elements across
