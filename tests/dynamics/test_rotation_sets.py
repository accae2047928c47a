"""Rotation sets of free joints: one motion in all of them, changes of coordinates between steps, singularities."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.random_systems import random_body

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.joints.channels import singularity_notes
from femflex.dynamics.reports.sensing import Sensing
from femflex.integrate import Dop853, Esdirk4, GeneralizedAlpha, driver, integrator
from femflex.rotations import (
    NAMED_SEQUENCES,
    coordinates_from_dcm,
    dcm_from_coordinates,
    is_symmetric,
    singularity_distance,
)
from femflex.system import System, ball_coordinates, free, spherical, weld

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
    hub = rigid_body(8.0, np.diag([5.0, 7.0, 9.0]), markers={"side": Marker.rigid(np.array([0.4, 0.1, 0.0]))})
    q0 = [0.0, 0.0, 0.0, *ball_coordinates(rotation, "xyz", Rotation.from_matrix(C).as_euler("XYZ"), rebase)]
    joints = (
        free("hub", rotation=rotation, rebase=rebase, q0=q0, u0=u0),
        weld("panel", "hub", parent_marker="side", child_marker="a"),
    )
    delta = {"panel": np.array([0.2, -0.1, 0.1])}
    return compile_system(System({"hub": hub, "panel": panel}, joints, delta0=delta))


def seen(model, times=TIMES, method=None):
    states = (method or Dop853(**TIGHT)).solve(model, times, model.x0).states
    return model.observe(times, states)


@pytest.fixture(scope="module")
def motion():
    """The motion in Euler parameters, several whole turns."""
    out = seen(tumbling())
    assert np.ptp(out["bodies/panel/delta"], axis=0).max() > 0.05
    turned = Rotation.from_quat(np.roll(out["bodies/hub/attitude"], -1, axis=1))
    assert np.linalg.norm((turned[0].inv() * turned).as_rotvec(), axis=1).max() > 3.0
    return out


def same(out, motion, tolerance):
    for path in ("bodies/hub/position", "bodies/panel/position", "bodies/hub/rate", "bodies/panel/delta"):
        assert out[path] == pytest.approx(motion[path], abs=tolerance), path
    alike = np.abs(np.einsum("ij,ij->i", out["bodies/hub/attitude"], motion["bodies/hub/attitude"]))
    assert np.sqrt(np.maximum(1.0 - alike**2, 0.0)).max() < max(tolerance, 1e-7)
    relative = Rotation.from_quat(np.roll(out["bodies/hub/attitude"], -1, axis=1)).inv()
    turned = relative * Rotation.from_quat(np.roll(motion["bodies/hub/attitude"], -1, axis=1))
    assert turned.magnitude().max() < tolerance


@pytest.mark.sampled(10)
@pytest.mark.parametrize(("rotation", "rebase"), ALL, ids=[name for name, _ in ALL])
def test_a_tumbling_flexible_craft_moves_alike_in_every_set(rotation, rebase, motion):
    same(seen(tumbling(rotation, rebase)), motion, 1e-9)


@pytest.mark.sampled(10)
@pytest.mark.parametrize("rotation", ["rodrigues", *NAMED_SEQUENCES])
def test_without_rebasing_a_short_turn_is_the_same_too(rotation):
    times, u0 = np.linspace(0.0, 1.0, 6), [0.0, 0.0, 0.0, 0.2, -0.2, 0.3]
    out = seen(tumbling(rotation, u0=u0), times)
    same(out, seen(tumbling(u0=u0), times), 1e-9)
    distance = out["joints/base-hub/singularity"]
    assert distance.min() > 0.1
    C = Rotation.from_quat(np.roll(out["bodies/hub/attitude"], -1, axis=1)).as_matrix()
    assert np.array(dcm_from_coordinates(out["q"][:, 3:6], rotation)) == pytest.approx(C, abs=1e-9)


METHODS = [
    Esdirk4(rtol=1e-8, atol=1e-9),
    GeneralizedAlpha(rtol=1e-7, atol=1e-8),
    *(integrator(f"scipy_{name}", rtol=1e-9, atol=1e-10) for name in ("dop853", "radau", "lsoda")),
]


@pytest.mark.sampled(6)
@pytest.mark.parametrize(("rotation", "rebase"), [("modified_rodrigues", False), ("rodrigues", True), ("zxz", True)])
@pytest.mark.parametrize("method", METHODS, ids=[method.name for method in METHODS])
def test_every_integrator_changes_coordinates_between_steps(method, rotation, rebase, motion):
    out = seen(tumbling(rotation, rebase), TIMES[:25], method)
    same(out, {path: values[:25] for path, values in motion.items()}, 2e-4)
    place = slice(6, 10) if rebase else slice(3, 6)
    jumps = np.linalg.norm(np.diff(out["q"][:, place], axis=0), axis=1)
    assert jumps.max() > 0.5  # there was a change


@pytest.fixture
def small_pieces(monkeypatch):
    """Blocks of seven rows, kernel calls of one trial step."""
    monkeypatch.setattr(driver, "ROWS", 7)
    monkeypatch.setattr(driver, "FIRST_BUDGET", 1)
    monkeypatch.setattr(driver, "adapted", lambda budget, seconds: 1)


COARSE = [Dop853(rtol=1e-7), Esdirk4(rtol=1e-6), GeneralizedAlpha(rtol=1e-4, atol=1e-5)]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("method", COARSE, ids=[method.name for method in COARSE])
@pytest.mark.parametrize(("rotation", "rebase"), [("modified_rodrigues", False), ("extrinsic xyz", True)])
def test_resuming_around_changes_gives_the_same_rows_bit_for_bit(method, rotation, rebase, small_pieces):
    model = tumbling(rotation, rebase)
    times = np.sort(np.concatenate([np.linspace(0, 5, 40), np.linspace(2, 2.1, 30)]))  # several rows a step, and none
    whole = method.solve(model, times, model.x0)
    blocks = list(method.blocks(model, times, model.x0))
    assert np.abs(np.diff(whole.states[:, 3:6], axis=0)).max() > 0.5
    for done in range(1, len(blocks), 2):
        count = sum(len(block.times) for block in blocks[:done])
        rest = method.solve(model, times, model.x0, state=blocks[done - 1].resume)
        assert np.array_equal(rest.states, whole.states[count:])
        assert rest.steps == whole.steps


@pytest.mark.parametrize("method", [Dop853(**TIGHT), Esdirk4(rtol=1e-9, atol=1e-10)], ids=["dop853", "esdirk4"])
def test_dense_output_is_smooth_in_meaning_across_a_change(method):
    # rows far closer than the steps: attitude follows its rate through every jump of the coordinates
    model, times = tumbling("modified_rodrigues"), np.linspace(0.0, 5.0, 5001)
    out = seen(model, times, method)
    assert np.abs(np.diff(out["q"][:, 3:6], axis=0)).max() > 0.5
    turned = Rotation.from_quat(np.roll(out["bodies/hub/attitude"], -1, axis=1))
    rates = (turned[:-2].inv() * turned[2:]).as_rotvec() / (times[2:] - times[:-2])[:, None]
    assert rates == pytest.approx(out["bodies/hub/rate"][1:-1], abs=2e-5)


@pytest.mark.parametrize("rotation", ["zxz", "extrinsic xzy", "rodrigues"])
def test_rebased_coordinates_tell_their_meaning(rotation, motion):
    model = tumbling(rotation, True)
    out = seen(model)
    C = Rotation.from_quat(np.roll(motion["bodies/hub/attitude"], -1, axis=1)).as_matrix()
    reported = dcm_from_coordinates(out["joints/base-hub/rotation"], rotation)
    assert np.array(reported) == pytest.approx(C, abs=1e-8)
    references = Rotation.from_quat(np.roll(out["q"][:, 6:10], -1, axis=1)).as_matrix()
    assert references @ dcm_from_coordinates(out["q"][:, 3:6], rotation) == pytest.approx(C, abs=1e-8)
    assert len(np.unique(out["q"][:, 6:10].round(12), axis=0)) > 2
    assert out["joints/base-hub/singularity"].min() > 0.5  # from pi/4 on it is re-based, but for the rest of a step
    names = [name for name, _ in model.system.coordinate_names()]
    assert names[6:10] == [f"base-hub.reference_e{k}" for k in range(4)]


def test_modified_parameters_stay_within_the_unit_ball_but_for_the_rest_of_a_step(motion):
    out = seen(tumbling("modified_rodrigues"))
    p = out["q"][:, 3:6]
    assert 0.9 < np.linalg.norm(p, axis=1).max() < 1.5
    assert out["joints/base-hub/singularity"] == pytest.approx(2 * np.pi - 4 * np.arctan(np.linalg.norm(p, axis=1)))


@pytest.mark.parametrize("rotation", ["rodrigues", "modified_rodrigues", "extrinsic xzy", "extrinsic zxz"])
def test_a_finite_step_goes_where_the_rates_lead(rotation):
    joint = spherical("hub", rotation=rotation, q0=[0.3, 0.7, -0.2])
    model = compile_system(System({"hub": rigid_body(1.0, np.eye(3))}, (joint,)))
    q, step = np.array([0.3, 0.7, -0.2]), np.array([0.4, -0.5, 0.3])
    small, qdot = np.empty(3), np.empty(3)
    own = (model.table, model.pool, model.work)
    model.second_order.kinematic(0.0, q, step, qdot, *own)
    model.second_order.advance(q, 1e-6 * step, small, *own)
    assert (small - q) / 1e-6 == pytest.approx(qdot, abs=1e-5)
    far = np.empty(3)
    model.second_order.advance(q, step, far, *own)
    turned = Rotation.from_matrix(dcm_from_coordinates(q, rotation)) * Rotation.from_rotvec(step)
    assert np.array(dcm_from_coordinates(far, rotation)) == pytest.approx(turned.as_matrix(), abs=1e-12)


def test_the_coordinates_of_extrinsic_angles_are_the_users():
    angles = np.array([0.4, -0.3, 1.1])
    x, y, z = (Rotation.from_rotvec(axis) for axis in np.diag(angles))  # about axes that stay: the last stands first
    joint = spherical("hub", rotation="extrinsic xyz", q0=angles)
    model = compile_system(System({"hub": rigid_body(1.0, np.eye(3))}, (joint,), libration_sequence="extrinsic xyz"))
    out = model.observe(np.zeros(1), model.x0[None])
    e = (z * y * x).as_quat(scalar_first=True)
    assert out["bodies/hub/attitude"][0] == pytest.approx(e * np.sign(e[0]), abs=1e-14)
    assert out["attitude/angles"][0] == pytest.approx(angles, abs=1e-14)
    sensed = Sensing(model).read(0.0, model.x0, ["attitude/angles"])["attitude/angles"]
    assert sensed == pytest.approx(angles, abs=1e-14)
    assert model.channels["attitude/angles"].description.endswith("extrinsic xyz")
    assert [name for name, _ in model.system.coordinate_names()] == [f"base-hub.fixed_{a}" for a in ("x1", "y2", "z3")]


@pytest.mark.parametrize("rotation", ["xyz", "zxz", "extrinsic yxy", "rodrigues"])
def test_a_set_that_starts_at_its_singularity_is_refused(rotation):
    angles = {"xyz": [0.2, np.pi / 2, 0.1], "rodrigues": [np.pi, 0, 0]}.get(rotation, [0, 0, 0])
    hub = {"hub": rigid_body(1.0, np.eye(3))}
    start = spherical("hub", rotation=rotation, q0=ball_coordinates(rotation, "xyz", np.array(angles)))
    with pytest.raises(
        ValueError, match=f"joint 'base-hub' starts at the singularity of its rotation set '{rotation}'"
    ):
        System(hub, (start,))
    q0 = ball_coordinates(rotation, "xyz", np.array(angles), True)
    model = compile_system(System(hub, (spherical("hub", rotation=rotation, rebase=True, q0=q0, u0=[0.1, 0.2, 0.3]),)))
    e = model.observe(np.zeros(1), model.x0[None])["bodies/hub/attitude"][0]
    assert Rotation.from_quat(np.roll(e, -1)).as_matrix() == pytest.approx(
        Rotation.from_euler("XYZ", angles).as_matrix(), abs=1e-14
    )
    assert np.isfinite(model.state_rate(0.0, model.x0)).all()


@pytest.mark.parametrize(
    ("joint", "told"),
    [
        ({"rotation": "euler_parameters"}, "'euler_parameters' has no singularity; leave `rebase` out"),
        ({"rotation": "modified_rodrigues"}, "'modified_rodrigues' switches to its shadow by itself"),
    ],
)
def test_sets_that_need_no_rebasing_say_so(joint, told):
    with pytest.raises(ValueError, match=told):
        spherical("hub", rebase=True, **joint)


def test_a_model_whose_coordinates_cannot_fail_has_no_change_of_them():
    assert tumbling().switch is None
    assert tumbling("xzy").switch is not None


@pytest.mark.parametrize("rotation", ["xzy", "zxz", "extrinsic xyz", "rodrigues", "modified_rodrigues"])
def test_steps_note_how_near_they_came_to_the_singularity(rotation):
    """Without rows, the least angle at all accepted states; with rows at all of them it is the channel's least."""
    model = tumbling(rotation)
    note = singularity_notes(model.system, model.table)["joints/base-hub/singularity"]
    model.work[note] = np.inf
    x = model.x0.copy()
    left = []
    for t in (0.0, 0.7, 1.1, 2.3):
        x[3:6] = coordinates_from_dcm(Rotation.from_rotvec([0.3 + t, 0.5, 0.2]).as_matrix(), rotation)
        left.append(float(singularity_distance(x[3:6], rotation)))
        model.switch(t, x, model.table, model.pool, model.work)
    k = int(np.argmin(left))
    assert model.work[note : note + 2] == pytest.approx([left[k], (0.0, 0.7, 1.1, 2.3)[k]], abs=1e-12)


@pytest.mark.parametrize("rotation", ["rodrigues", "modified_rodrigues", *NAMED_SEQUENCES])
def test_sets_there_and_back(rotation):
    C = Rotation.random(20, random_state=3).as_matrix()
    q = coordinates_from_dcm(C, rotation)
    assert dcm_from_coordinates(q, rotation) == pytest.approx(C, abs=1e-12)
    if rotation in NAMED_SEQUENCES:
        letters = rotation[-3:]
        axes = np.eye(3)[["xyz".index(letter) for letter in letters]]
        turns = [Rotation.from_rotvec(angle * axis) for angle, axis in zip(q[0], axes, strict=True)]
        order = turns[::-1] if rotation.startswith("extrinsic") else turns
        assert (order[0] * order[1] * order[2]).as_matrix() == pytest.approx(C[0], abs=1e-12)
        assert is_symmetric(rotation) == (len(set(letters)) == 2)
