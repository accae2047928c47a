"""Rotation sets of free joints: one motion in all of them, changes of coordinates between steps, singularities."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.random_systems import random_body
from support.scipy_integrators import integrator

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import Dop853, Esdirk4
from femflex.rotations import (
    NAMED_SEQUENCES,
)
from femflex.system import System, ball_coordinates, free, weld

REBASED = ("rodrigues", *NAMED_SEQUENCES)
ALL = [("modified_rodrigues", False), *((rotation, True) for rotation in REBASED)]
START = Rotation.from_euler("XYZ", [0.3, 0.8, -0.4]).as_matrix()  # far from every set's singularity
TUMBLE = [0.2, -0.1, 0.3, 0.9, -0.6, 1.4]
TIMES = np.linspace(0.0, 10.0, 41)
TIGHT = {"rtol": 1e-12, "atol": 1e-13}


def tumbling(rotation="euler_parameters", rebase=False, C=START, u0=TUMBLE):
    """A craft whose flexible panel bends while it tumbles, free, turned by C at t = 0."""
    rng = np.random.default_rng(5)
    panel, _ = random_body(rng, 3)
    hub = rigid_body(8.0, np.diag([5.0, 7.0, 9.0]), markers={"side": Marker.at_position(np.array([0.4, 0.1, 0.0]))})
    q0 = [0.0, 0.0, 0.0, *ball_coordinates(rotation, "xyz", Rotation.from_matrix(C).as_euler("XYZ"), rebase)]
    joints = (
        free("hub", rotation=rotation, rebase=rebase, q0=q0, u0=u0),
        weld("panel", "hub", parent_marker="side", child_marker="a"),
    )
    delta = {"panel": np.array([0.2, -0.1, 0.1])}
    return compile_system(System({"hub": hub, "panel": panel}, joints, delta0=delta))


def simulated(model, times=TIMES, method=None):
    states = (method or Dop853(**TIGHT)).solve(model, times, model.x0).states
    return model.observe(times, states)


@pytest.fixture(scope="module")
def motion():
    """The motion in Euler parameters, several whole turns."""
    out = simulated(tumbling())
    assert np.ptp(out["bodies/panel/delta"], axis=0).max() > 0.05
    turned = Rotation.from_quat(np.roll(out["bodies/hub/attitude"], -1, axis=1))
    assert np.linalg.norm((turned[0].inv() * turned).as_rotvec(), axis=1).max() > 3.0
    return out


def assert_same_motion(out, motion, tolerance):
    for path in ("bodies/hub/position", "bodies/panel/position", "bodies/hub/rate", "bodies/panel/delta"):
        assert out[path] == pytest.approx(motion[path], abs=tolerance), path
    alike = np.abs(np.einsum("ij,ij->i", out["bodies/hub/attitude"], motion["bodies/hub/attitude"]))
    assert np.sqrt(np.maximum(1.0 - alike**2, 0.0)).max() < max(tolerance, 1e-7)
    relative = Rotation.from_quat(np.roll(out["bodies/hub/attitude"], -1, axis=1)).inv()
    turned = relative * Rotation.from_quat(np.roll(motion["bodies/hub/attitude"], -1, axis=1))
    assert turned.magnitude().max() < tolerance


@pytest.mark.sampled(10)
@pytest.mark.parametrize(("rotation", "rebase"), ALL, ids=[name for name, _ in ALL])
def test_motion_is_the_same_in_every_rotation_set(rotation, rebase, motion):
    assert_same_motion(simulated(tumbling(rotation, rebase)), motion, 1e-9)


METHODS = [
    Esdirk4(rtol=1e-8, atol=1e-9),
    *(integrator(f"scipy_{name}", rtol=1e-9, atol=1e-10) for name in ("dop853", "radau", "lsoda")),
]


@pytest.mark.sampled(6)
@pytest.mark.parametrize(("rotation", "rebase"), [("modified_rodrigues", False), ("rodrigues", True), ("zxz", True)])
@pytest.mark.parametrize("method", METHODS, ids=[method.name for method in METHODS])
def test_integrators_change_coordinates_between_steps(method, rotation, rebase, motion):
    out = simulated(tumbling(rotation, rebase), TIMES[:25], method)
    assert_same_motion(out, {path: values[:25] for path, values in motion.items()}, 2e-4)
    place = slice(6, 10) if rebase else slice(3, 6)
    jumps = np.linalg.norm(np.diff(out["q"][:, place], axis=0), axis=1)
    assert jumps.max() > 0.5  # there was a change


COARSE = [Dop853(rtol=1e-7), Esdirk4(rtol=1e-6)]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("method", COARSE, ids=[method.name for method in COARSE])
@pytest.mark.parametrize(("rotation", "rebase"), [("modified_rodrigues", False), ("extrinsic xyz", True)])
def test_resume_around_change_of_coordinates_is_exact(method, rotation, rebase):
    model = tumbling(rotation, rebase)
    times = np.sort(np.concatenate([np.linspace(0, 5, 2500), np.linspace(2, 2.1, 1500)]))
    whole = method.solve(model, times, model.x0)
    blocks = list(method.blocks(model, times, model.x0))
    assert np.abs(np.diff(whole.states[:, 3:6], axis=0)).max() > 0.5
    for done in range(1, len(blocks)):
        count = sum(len(block.times) for block in blocks[:done])
        rest = method.solve(model, times, model.x0, state=blocks[done - 1].resume)
        assert np.array_equal(rest.states, whole.states[count:])
        assert rest.steps == whole.steps


@pytest.mark.parametrize("method", [Dop853(**TIGHT), Esdirk4(rtol=1e-9, atol=1e-10)], ids=["dop853", "esdirk4"])
def test_dense_output_across_change_of_coordinates(method):
    # rows far closer than the steps: attitude follows its rate through every jump of the coordinates
    model, times = tumbling("modified_rodrigues"), np.linspace(0.0, 5.0, 5001)
    out = simulated(model, times, method)
    assert np.abs(np.diff(out["q"][:, 3:6], axis=0)).max() > 0.5
    turned = Rotation.from_quat(np.roll(out["bodies/hub/attitude"], -1, axis=1))
    rates = (turned[:-2].inv() * turned[2:]).as_rotvec() / (times[2:] - times[:-2])[:, None]
    assert rates == pytest.approx(out["bodies/hub/rate"][1:-1], abs=2e-5)
