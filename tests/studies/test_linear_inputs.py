"""Inputs of linear models one by one, and the model of a craft with lagged sensors and signals by differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.studies.linear import linear_model
from femflex.studies.linear.inputs import inputs_of, known_inputs, usual_inputs
from femflex.studies.linear.linear_model import _moving
from femflex.system import (
    Controller,
    Environment,
    Joint,
    Load,
    Profile,
    Sensor,
    System,
    prismatic,
    revolute,
    signal,
    spherical,
    weld,
)
from femflex.system.held_commands import commanded

XYZ = "xyz"


def craft(**more) -> System:
    """A hub on two slides and a turn, with an arm on a turn that is prescribed and a rod on a slide that is locked."""
    hub = rigid_body(3.0, np.diag([0.4, 0.5, 0.6]), [0.1, 0.0, 0.05], {"rim": Marker.rigid([0.5, 0.2, 0.0])})
    arm = rigid_body(1.5, np.diag([0.1, 0.2, 0.2]), [0.3, 0, 0], {"end": Marker.rigid([0.6, 0.0, 0.0])})
    rod = rigid_body(0.5, np.diag([0.1, 0.1, 0.1]))
    base = Joint(
        "hub",
        name="base",
        translations=[[1, 0, 0], [0, 1, 0]],
        rotations=[[0, 0, 1]],
        stiffness=[5.0, 0.0, 7.0],
        rest=[0.1, 0.3, 0.2],
        q0=[0.4, -0.2, 0.3],
        kind="general",
    )
    turned = Profile(np.zeros(1), np.array([[0.2, 0.5, 0.3]]))
    law = Controller("law", lambda t, seen, memory: (np.zeros(2), memory), 0.1, (), {"a": "N", "b": "N m"}, held=[3, 4])
    return System(
        {"hub": hub, "arm": arm, "rod": rod},
        (
            base,
            revolute("arm", "hub", name="elbow", parent_marker="rim", axis=[0, 1, 0], motion=(turned,)),
            prismatic("rod", "arm", name="rail", parent_marker="end", motion=(0.25,)),
        ),
        loads=(
            Load("push", "hub", force=np.array([0.0, 2.0, 0.0])),
            Load("pulse", "arm", torque=np.array([[0, 0, 0.0], [0, 0, 4.0], [0, 0, 0]]), times=np.array([0, 1, 2.0])),
        ),
        effectors=(signal("level", [0.0, 2.0], [1.0, 5.0], unit="V"), law),
        **more,
    )


def test_every_load_marker_joint_signal_and_command_is_an_input_in_its_unit():
    found = known_inputs(commanded(craft()))
    wanted = {}
    for load in ("push", "pulse"):
        for what, unit in (("force", "N"), ("torque", "N m")):
            wanted |= {f"loads/{load}/{what}:{a}": (unit, "load", load, f"{what}:{a}", 5.0) for a in XYZ}
    for place in ("hub.origin", "hub.rim", "arm.origin", "arm.end", "rod.origin"):
        for what, unit in (("force", "N"), ("torque", "N m")):
            wanted |= {f"markers/{place}/{what}:{a}": (unit, "marker", place, f"{what}:{a}", 5.0) for a in XYZ}
    base = [name for name in craft().joints[0].freedom_names()]
    for name, unit in zip(base, ("N", "N", "N m"), strict=True):
        wanted[f"joints/{name}/effort"] = (unit, "effort", name, "", 5.0)
    wanted["motions/elbow.angle"] = ("rad/s^2", "motion", "elbow.angle", "", 1.0)
    wanted["motions/rail.slide"] = ("m/s^2", "motion", "rail.slide", "", 1.0)
    wanted["effectors/level/value"] = ("V", "effector", "level", "value", 1e-4)
    wanted["effectors/law/a"] = ("N", "effector", "law", "a", 1e-4)
    wanted["effectors/law/b"] = ("N m", "effector", "law", "b", 1e-4)
    assert {key: (one.unit, one.kind, one.owner, one.part, one.step) for key, one in found.items()} == wanted
    assert all(key == one.path for key, one in found.items())
    light = replace(
        craft(), bodies={name: rigid_body(0.1, np.eye(3), markers=b.markers) for name, b in craft().bodies.items()}
    )
    assert known_inputs(light)["loads/push/force:x"].step == 1.0


def test_inputs_left_out_are_loads_along_their_axes_motions_that_move_and_what_effectors_take():
    system = commanded(craft())
    assert _moving(system) == ["elbow.angle"]  # the rail is held where it is
    assert usual_inputs(system, _moving(system)) == [
        "loads/push/force:y",
        "loads/pulse/torque:z",
        "motions/elbow.angle",
        "effectors/level/value",
        "effectors/law/a",
        "effectors/law/b",
    ]
    found = inputs_of(system, ["loads/pulse/force", "motions/rail.slide"])
    assert [one.path for one in found] == [*(f"loads/pulse/force:{a}" for a in XYZ), "motions/rail.slide"]
    with pytest.raises(KeyError, match=r"the craft has no input 'loads/puls/force:x'; did you mean"):
        inputs_of(system, ["loads/puls/force:x"])


def test_a_load_is_raised_along_one_axis_at_all_times():
    system, known = craft(), known_inputs(craft())
    more = known["loads/pulse/torque:y"].moved(system, 0.7, {})
    assert more.loads[1].torque.tolist() == [[0, 0.7, 0], [0, 0.7, 4], [0, 0.7, 0]] and not more.loads[1].force.any()
    assert more.loads[0] is system.loads[0]
    more = known["loads/push/force:x"].moved(system, -0.5, {})
    assert more.loads[0].force.tolist() == [-0.5, 2, 0] and not more.loads[0].torque.any()
    added = known["markers/arm.end/torque:z"].moved(system, 0.3, {}).loads
    assert len(added) == 3 and added[:2] == system.loads
    assert (added[2].body, added[2].marker, added[2].frame) == ("arm", "end", "marker")
    assert added[2].torque.tolist() == [0, 0, 0.3] and not added[2].force.any() and added[2].times is None
    assert known["motions/elbow.angle"].moved(system, 0.3, {}) is system


def test_an_effort_pushes_where_the_joint_is_and_leaves_the_other_freedoms():
    system, known = craft(), known_inputs(craft())
    joint = system.joints[0]
    places = dict(zip(joint.freedom_names(), [0.6, -0.7, 0.9], strict=True))
    for k, (name, at) in enumerate(places.items()):
        moved = known[f"joints/{name}/effort"].moved(system, 1.3, places)
        one = moved.joints[0]

        def force(joint, k, at):
            return -joint.stiffness[k] * (at - joint.rest[k])

        assert force(one, k, at) - force(joint, k, at) == pytest.approx(1.3)
        others = [j for j in range(3) if j != k]
        assert one.stiffness[others].tolist() == joint.stiffness[others].tolist()
        assert one.rest[others].tolist() == joint.rest[others].tolist() and one.q0.tolist() == joint.q0.tolist()
        assert moved.joints[1:] == system.joints[1:]


def test_a_prescribed_motion_gets_powers_of_the_time_from_its_instant_on():
    system, t, c = craft(), 1.5, np.array([0.3, -0.2, 0.7])
    led = known_inputs(system)["motions/elbow.angle"].led(system, t, c)
    later = np.array([1.5, 2.0, 3.5])
    own = 0.2 + 0.5 * later + 0.3 * later**2
    added = c[0] + c[1] * (later - t) + c[2] * (later - t) ** 2
    assert led.joints[1].held[0](later)[0] == pytest.approx(own + added)
    assert led.joints[0] is system.joints[0] and led.joints[2] is system.joints[2]


def test_a_prescribed_motion_that_begins_away_from_zero_is_an_input():
    """A rail that is locked away from its zero: outputs by differences of its length."""
    still = prismatic("rod", "arm", name="rail", parent_marker="end", motion=(0.25,))
    system = replace(craft(), effectors=(), joints=(craft().joints[0], replace(craft().joints[1], motion=()), still))
    found = linear_model(
        system, ["motions/rail.slide"], ["bodies/rod/position:x"], at=0.5, state=compile_system(system).x0
    )
    states = [name for name, _ in found.states]
    assert states[-2:] == ["rail.slide", "rail.slide_rate"] and found.states[-2:] == (
        ("rail.slide", "m"),
        ("rail.slide_rate", "m/s"),
    )
    n = len(states)
    assert found.A[n - 2].tolist() == [0.0] * (n - 1) + [1.0] and found.B[n - 2 :].ravel().tolist() == [0.0, 1.0]
    C, D = np.zeros(n), found.D.item()
    for k, name in enumerate(states[:-1]):
        if name.endswith("_rate"):
            continue
        ends = []
        for h in (1e-6, -1e-6):
            model = compile_system(system)
            x, q = model.x0, [name for name, _ in system.coordinate_names()]
            x = x + h * np.eye(len(x))[q.index(name)]
            if name == "rail.slide":
                model = compile_system(
                    replace(system, joints=(*system.joints[:2], replace(still, motion=(0.25 + h,), q0=[])))
                )
            ends.append(model.observe(np.array([0.5]), x[None])["bodies/rod/position"][0][0])
        C[k] = (ends[0] - ends[1]) / 2e-6
    assert found.C[0] == pytest.approx(C, abs=1e-7) and D == pytest.approx(0.0, abs=1e-9) and abs(C[n - 2]) > 0.1


def test_signals_and_held_commands_are_moved_by_their_value():
    system = commanded(replace(craft(), z0={"law.a": 9.0, "law.next": 1.0}))
    assert system.z0 == {} and not system.controllers
    known = known_inputs(system)
    raised = {one.name: one for one in known["effectors/level/value"].moved(system, 0.25, {}).effectors}
    assert raised["level"].parameters.tolist() == signal("level", [0.0, 2.0], [1.25, 5.25]).parameters.tolist()
    seen = {}
    for path in ("effectors/law/a", "effectors/law/b"):
        model = compile_system(known[path].moved(system, 0.25, {}))
        values = model.observe(np.array([1.0]), model.x0[None])
        seen[path] = [float(values[f"effectors/{name}"][0]) for name in ("law/a", "law/b", "level/value")]
    assert seen == {"effectors/law/a": [3.25, 4.0, 3.0], "effectors/law/b": [3.0, 4.25, 3.0]}


TURNED = np.array([[np.cos(0.3), -np.sin(0.3), 0.0], [np.sin(0.3), np.cos(0.3), 0.0], [0.0, 0.0, 1.0]])
BEAM = UniformBeam(1.0, EA=1e4, EIy=10.0, EIz=7.0, GJ=10.0, mass_per_length=1.0, rotary_inertia=False)


def spinner(load: float = 0.6, effort: float = 0.0, gain: float = 0.0) -> System:
    """A ball-jointed hub with a beam under gravity, an accelerometer with a lag on it, and a sprung wheel."""
    hub = rigid_body(2.0, np.array([[0.5, 0.02, 0], [0.02, 0.4, 0.03], [0, 0.03, 0.6]]), [0.0, 0.02, 0.05])
    hub = replace(hub, markers={**hub.markers, "rim": Marker.rigid([0.2, 0.1, 0.0], TURNED)})
    wheel = rigid_body(0.3, np.diag([0.02, 0.01, 0.01]))
    beam = beam_body(BEAM, BeamFunctions(y=1, z=1, axial=0, torsion=0))
    gauge = Sensor("gauge", "acceleration", "hub", "rim", bandwidth=4.0, bias=np.array([gain, 0, 0]))
    return System(
        {"hub": hub, "beam": beam, "wheel": wheel},
        (
            spherical("hub", rotation="euler_parameters", stiffness=3.0, damping=0.2),
            weld("beam", "hub", parent_marker="rim", child_marker="root"),
            revolute("wheel", "hub", name="axle", axis=[1, 2, 2], stiffness=[0.8], rest=[effort / 0.8]),
        ),
        environment=Environment(gravity=np.array([0.3, -1.0, -9.0])),
        loads=(Load("motor", "hub", "rim", "marker", torque=np.array([0.0, load, 0.0])),),
        effectors=gauge.effectors,
    )


def test_the_model_at_an_instant_is_the_derivative_of_all_states_and_outputs():
    system = spinner()
    model = compile_system(system)
    n_q, n_u = model.n_q, model.n_u
    rng = np.random.default_rng(5)
    turn = np.array([0.9, 0.2, -0.3, 0.25])
    x = model.x0 + 0.2 * rng.normal(size=model.n_x)
    x[:4] = turn / np.linalg.norm(turn)
    outputs = ["effectors/gauge/y", "markers/beam.tip/position:z", "bodies/hub/rate:x"]
    found = linear_model(system, ["loads/motor/torque:y", "joints/axle.angle/effort"], outputs, at=0.7, state=x)
    names = [name for name, _ in system.velocity_names()]
    assert [name for name, _ in found.states] == [
        *(name.removesuffix("_rate").replace("omega_", "turn_") for name in names),
        *names,
        *(f"gauge.lagged_{a}" for a in XYZ),
    ]
    units = [unit for _, unit in found.states]
    assert units[:3] == ["rad"] * 3 and units[n_u : n_u + 3] == ["rad/s"] * 3 and units[-3:] == ["m/s"] * 3
    assert (
        units[names.index("beam.delta1_rate")] == "kg^1/2 m"
        and units[n_u + names.index("beam.delta1_rate")] == "kg^1/2 m/s"
    )
    assert found.inputs == (("loads/motor/torque:y", "N m"), ("joints/axle.angle/effort", "N m"))
    assert [unit for _, unit in found.outputs] == ["m/s^2", "m", "rad/s"] and found.t == 0.7 and found.about is None

    def displaced(dxi: np.ndarray) -> np.ndarray:
        """Increments: rotation vector in body axes of the ball, the others as they are."""
        q, u, z = x[:n_q].copy(), x[n_q : n_q + n_u] + dxi[n_u : 2 * n_u], x[n_q + n_u :] + dxi[2 * n_u :]
        s, v = np.cos(np.linalg.norm(dxi[:3]) / 2), dxi[:3] / 2
        a, b = x[0], x[1:4]
        q[:4] = np.concatenate([[a * s - b @ v], a * v + s * b + np.cross(b, v)])
        q[4:] += dxi[3:n_u]
        return np.concatenate([q, u, z])

    def flow(model, x):
        """Rates of increments (dxi' = du + W dxi comes by hand below), velocities and states; outputs."""
        rate = model.state_rate(0.7, x)
        seen = model.observe(np.array([0.7]), x[None])
        out = [seen["effectors/gauge/y"][0], seen["markers/beam.tip/position"][0][2], seen["bodies/hub/rate"][0][0]]
        return rate[n_q:], np.array(out, float)

    h, n = 1e-6, 2 * n_u + 3
    below, C = np.zeros((n_u + 3, n)), np.zeros((3, n))
    for k in range(n):
        ends = [flow(model, displaced(s * h * np.eye(n)[k])) for s in (1, -1)]
        below[:, k], C[:, k] = ((ends[0][i] - ends[1][i]) / (2 * h) for i in (0, 1))
    assert found.A[n_u:] == pytest.approx(below, abs=3e-7 * np.abs(below).max())
    assert found.C == pytest.approx(C, abs=3e-7 * np.abs(C).max())
    w = x[n_q : n_q + 3]
    W = np.zeros((n_u, n_u))
    W[:3, :3] = np.array([[0, w[2], -w[1]], [-w[2], 0, w[0]], [w[1], -w[0], 0]])
    assert found.A[:n_u] == pytest.approx(np.hstack([W, np.eye(n_u), np.zeros((n_u, 3))]), abs=1e-6)
    for k, (load, effort) in enumerate(((0.5, 0.0), (0.0, 0.5))):
        ends = [flow(compile_system(spinner(0.6 + s * load, s * effort)), x) for s in (1, -1)]
        assert found.B[:n_u, k] == pytest.approx(np.zeros(n_u), abs=1e-12)
        wanted = ends[0][0] - ends[1][0]
        assert found.B[n_u:, k] == pytest.approx(wanted, abs=1e-7 * np.abs(wanted).max())
        assert found.D[:, k] == pytest.approx(ends[0][1] - ends[1][1], abs=1e-7)
    assert found.y0 == pytest.approx(flow(model, x)[1], rel=1e-12)
    part = found.selected(["joints/axle.angle/effort"], ["bodies/hub/rate:x", "effectors/gauge/y"])
    assert part.y0 == pytest.approx(found.y0[[2, 0]]) and part.inputs == found.inputs[1:]


def test_outputs_left_out_are_attitude_root_rate_deflections_and_effectors():
    found = linear_model(spinner(), [])
    names = [name for name, _ in found.outputs]
    wanted = [*(f"bodies/hub/rate:{a}" for a in XYZ), *(f"markers/beam.tip/deflection:{a}" for a in XYZ)]
    wanted += [f"effectors/gauge/{a}" for a in XYZ]
    assert set(wanted) <= set(names)
    assert not [name for name in names if name.startswith(("bodies/wheel", "bodies/beam", "markers/hub", "joints"))]
    known = {"attitude", "bodies", "markers", "effectors"}
    assert {name.partition("/")[0] for name in names} == known and found.left_out == () and found.about is not None


def test_a_prescribed_motion_is_no_input_of_a_system_with_loops():
    system = craft()
    rope = spherical("hub", name="tie")
    system = replace(system, effectors=(), loops=(rope,))
    x = compile_system(system).x0
    with pytest.raises(
        ValueError, match="with loops a prescribed motion cannot be an input of a linear model; take loads"
    ):
        linear_model(system, ["motions/elbow.angle"], [], at=0.0, state=x)
