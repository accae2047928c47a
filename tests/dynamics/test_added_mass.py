"""Mass that an effector adds at a marker: that of a rigid body moves a craft as the welded body itself does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femflex import build_system, read_case
from femflex.dynamics.model import compile_system
from femflex.kernels.entries import ACT, entry
from femflex.kernels.vectors import cross, load3, load9, scale, store3, turn, turn_back
from femflex.system import Effector

CASE = """
[run]
duration = "1 s"
samples = 2
[bodies.hub]
kind = "rigid"
mass = "20 kg"
inertia = ["2 kg m^2", "3 kg m^2", "4 kg m^2"]
[bodies.boom]
kind = "analytic"
length = "3 m"
EA = "1e5 N"
EIy = "400 N m^2"
EIz = "600 N m^2"
GJ = "300 N m^2"
mass_per_length = "1.1 kg/m"
ry = "30 mm"
rz = "20 mm"
strain = "STRAIN"
functions = { y = 2, z = 2, axial = 4, torsion = 1, joints = ["root"] }
[bodies.heavy]
kind = "rigid"
mass = "5 kg"
inertia = ["0.5 kg m^2", "0.6 kg m^2", "0.7 kg m^2"]
[[joints]]
kind = "free"
child = "hub"
[[joints]]
kind = "revolute"
parent = "hub"
child = "boom"
axis = [0, 0, 1]
[[joints]]
kind = "weld"
parent = "boom"
parent_marker = "tip"
child = "heavy"
"""


@entry(ACT)
def added(t, seen, z, parameters, out):
    C = load9(seen, 3)
    for k in range(36):
        out[k] = 0.0
    for i in range(3):
        out[7 * i] = parameters[0]
        for j in range(3):
            inertia = 0.0
            for k in range(3):
                inertia += C[3 * i + k] * parameters[1 + k] * C[3 * j + k]
            out[6 * (3 + i) + 3 + j] = inertia


@entry(ACT)
def turning(t, seen, z, parameters, out):
    C, omega = load9(seen, 3), load3(seen, 15)
    w = turn_back(C, omega)
    momentum = turn(C, (parameters[1] * w[0], parameters[2] * w[1], parameters[3] * w[2]))
    store3(out, 3, scale(-1.0, cross(omega, momentum)))


@pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
@pytest.mark.parametrize(("strain", "size"), [("linear", 0.3), ("condensed", 0.05), ("nonlinear", 0.05)])
def test_added_mass_of_a_rigid_body_is_that_of_the_body(tmp_path, strain, size):
    path = tmp_path / "case.toml"
    path.write_text(CASE.replace("STRAIN", strain))
    system = build_system(read_case(path))
    water = Effector("water", turning, (("boom", "tip"),), parameters=np.array([5.0, 0.5, 0.6, 0.7]), added_mass=added)
    wet = replace(
        system,
        bodies={name: body for name, body in system.bodies.items() if name != "heavy"},
        joints=tuple(joint for joint in system.joints if joint.child != "heavy"),
        effectors=(water,),
    )
    models = compile_system(system), compile_system(wet)
    rng = np.random.default_rng(0)
    x, udot = models[0].x0 + size * rng.normal(size=models[0].n_x), rng.normal(size=models[0].n_u)
    x[3:7] /= np.linalg.norm(x[3:7])
    found = []
    for model in models:
        q, u, _ = (np.ascontiguousarray(part) for part in model.parts(x))
        corrected, solved = np.empty(model.n_u), np.empty(model.n_u)
        model.second_order.correct(0.0, q, u, udot, corrected, 1e-3, 1e-6, *model.workspace.arrays)
        model.second_order.solve(0.0, q, udot, solved, 1.0, 1e-3, 1e-6, *model.workspace.arrays)
        found.append([model.state_rate(0.0, x), model.mass_matrix(0.0, x), corrected, solved])
    for body, mass in zip(*found, strict=True):
        assert mass == pytest.approx(body, rel=1e-9, abs=1e-10 * np.abs(body).max())
    rows = models[1].terms(np.zeros(1), x[None])
    assert np.sum(list(rows.values()), axis=0) == pytest.approx(0.0, abs=1e-11 * np.abs(rows["inertia"]).max())
