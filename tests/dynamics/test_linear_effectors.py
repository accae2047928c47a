"""Linear models and small motions of craft whose wheels, thrusters, tanks and laws have states."""

import numpy as np
import pytest
from support.effector_builders import (
    Sensor,
    Supply,
    reaction_wheel,
    signal,
    tank,
    tank_variation,
    thruster,
    without_axial_inertia,
)
from support.random_systems import random_body

from femflex.body import Marker
from femflex.body.flexible import rigid_body
from femflex.dynamics import compile_system
from femflex.dynamics.motion.increments import advanced
from femflex.effectors import LowPass, Pd
from femflex.linear.equilibrium import equilibrium
from femflex.linear.system_modes import modes_about
from femflex.reduction import BeamFunctions, Damping, UniformBeam, beam_body
from femflex.studies.linear import linear_model, poles_of
from femflex.system import System, free, weld, with_attached

J = np.diag([3.0, 4.0, 5.0])


def controlled(stiffness=2.0, damping=1.5, beam=None):
    """A hub whose wheel about z follows a PD law of attitude and rate, maybe with a beam on it."""
    star, gyro = Sensor("star", "attitude", "hub"), Sensor("gyro", "rate", "hub")
    law = Pd(inputs=["star.z", "gyro.z"], outputs=["torque"], stiffness=-stiffness, damping=-damping).controller("law")
    wheel = reaction_wheel("w", "hub", 0.5, torque="law.torque")
    bodies = {"hub": rigid_body(20.0, J, markers={"east": Marker.at_position(np.array([0.4, 0.0, 0.0]))})}
    joints = [free("hub")]
    if beam is not None:
        bodies["beam"] = beam
        joints.append(weld("beam", "hub", parent_marker="east", child_marker="root"))
    effectors = (*star.effectors, *gyro.effectors, law, wheel)
    return System(bodies, tuple(joints), effectors=effectors)


def test_gyrostat_has_nutation_poles_and_motor_torque_as_input():
    """h / sqrt(A B) across a wheel of momentum h in a resting hub; the motor turns the hub backwards by 1 / C."""
    pilot = signal("pilot", [0.0, 1.0], [0.0, 0.0])
    wheel = reaction_wheel("w", "hub", 0.5, torque="pilot.value", initial_speed=20.0)
    system = System({"hub": rigid_body(20.0, J)}, (free("hub"),), effectors=(pilot, wheel))
    found = linear_model(system, ["effectors/pilot/value"], ["bodies/hub/rate:z", "effectors/w/speed"])
    fast = [p for p in poles_of(found) if not p.rigid and abs(p.value) > 1e-3]
    assert [p.value for p in fast] == pytest.approx([10.0j / np.sqrt(12.0)], rel=1e-7)
    G = found.frequency_response(np.array([0.7]))[0, :, 0]
    assert G[0] == pytest.approx(-1.0 / (5.0 * 0.7j), rel=1e-7)
    assert G[1] == pytest.approx((1.0 / 0.5 + 1.0 / 5.0) / 0.7j, rel=1e-7)


@pytest.mark.parametrize("damping", [1.5, -0.1])
def test_wheel_with_controller_has_closed_loop_poles(damping):
    """C s^2 + d s + k = 0 about the axis of the wheel; all else is known rigid motion, the wheel's momentum too."""
    rest = equilibrium(controlled(2.0, damping))
    wanted = np.roots([5.0, damping, 2.0])
    assert sorted(rest.eigenvalues, key=lambda s: s.imag) == pytest.approx(
        sorted(wanted, key=lambda s: s.imag), rel=1e-7
    )
    assert rest.stable == (damping > 0) and rest.growth == pytest.approx(max(0.0, -damping / 10.0), rel=1e-6)
    modes = modes_about(rest)
    assert modes.names[-1] == "rotation z" and not modes.known[-1]
    assert {"rotation x", "rotation y", "translation z", "w.momentum"} <= set(modes.names)
    poles = poles_of(linear_model(controlled(2.0, damping)))
    assert sorted(p.name for p in poles if not p.rigid) == ["rotation z"]


def test_poles_with_beam_and_controller_are_those_of_state_matrix():
    shape = UniformBeam(3.0, 0.4, 1e5, 60.0, 90.0, 40.0)
    beam = beam_body(shape, BeamFunctions(y=2, z=0, axial=0, torsion=0), damping=Damping(0.02))
    system = controlled(beam=beam)
    rest = equilibrium(system)
    whole = linear_model(system, [], []).eigenvalues()
    fast = whole[np.abs(whole) > 1e-3]
    assert len(fast) == 6 and len(rest.eigenvalues) == 6 and rest.stable
    assert np.sort_complex(rest.eigenvalues) == pytest.approx(np.sort_complex(fast), rel=1e-7)
    assert {"rotation z", "bending 1", "bending 2"} <= {p.name for p in poles_of(linear_model(system))}


def test_linear_model_with_effectors_is_derivative_of_rate():
    """At an instant of a tumbling flexible craft, against differences of the compiled rate by other steps."""
    boom = with_attached(random_body(np.random.default_rng(3), 2)[0], "c", 0.5, np.zeros((3, 3)))
    hub = rigid_body(20.0, J, markers={"nozzle": Marker.at_position(np.array([-0.4, 0.1, 0.0]))})
    gyro = Sensor("gyro", "rate", "hub")
    smooth = LowPass(inputs=["gyro.y"], outputs=["torque"], frequency=0.8, order=2).controller("filter")
    wheel = reaction_wheel("w", "hub", 0.5, axis=(0, 1, 0), torque="filter.torque", viscous=0.01, initial_speed=3.0)
    valve = signal("valve", [0.0, 5.0], [0.3, 0.9])
    jet = thruster("jet", "hub", 3.0, marker="nozzle", axis=(1, 0.2, 0), command="valve.value", lag=0.1,
                   specific_impulse=20.0, supply=Supply("tank", "boom", "c"))  # fmt: skip
    joints = (free("hub", u0=[0.1, 0, 0.05, 0.2, -0.3, 0.4]), weld("boom", "hub", child_marker="b"))
    effectors = (*gyro.effectors, smooth, wheel, valve, jet, tank("tank", 0.5, ["jet"]))
    varying = {"boom": tank_variation(boom, {"tank": ("c", 0.5, 0.0)})}
    system = System(
        {"hub": without_axial_inertia(hub, wheel), "boom": boom}, joints, effectors=effectors, varying=varying
    )
    model = compile_system(system)
    x = model.x0.copy()
    x[-model.n_z :] += 0.1 * model.system.state_sizes() * np.abs(np.sin(1.0 + np.arange(model.n_z)))
    found = linear_model(system, ["effectors/valve/value"], ["bodies/hub/rate"], at=0.4, state=x)
    n, m = len(found.mass), len(found.A) - 2 * len(found.mass)
    names = [name for name, _ in found.states[2 * n :]]
    assert {"filter.x1", "filter.x2", "w.momentum", "tank.mass"} <= set(names) and m == len(names)
    places = [[name for name, _ in system.state_names()].index(name) for name in names]
    sizes = system.state_sizes()[places]
    q, u, z = model.parts(x)

    def rate(dxi, du, dz):
        w = z.copy()
        w[places] += dz
        dx = model.state_rate(0.4, np.concatenate([advanced(model, q, dxi), u + du, w]))
        return np.concatenate([dx[model.n_q : model.n_q + n], dx[model.n_q + n :][places]])

    steps = np.concatenate([np.full(2 * n, 3e-5), 3e-5 * sizes])
    wanted = []
    for step, e in zip(steps, np.eye(2 * n + m), strict=True):
        parts = np.split(step * e, [n, 2 * n])
        wanted.append((rate(*parts) - rate(*(-part for part in parts))) / (2 * step))
    wanted = np.column_stack(wanted)
    for rows in (slice(0, n), *(slice(k, k + 1) for k in range(n, n + m))):
        for columns in (slice(0, n), slice(n, 2 * n), *(slice(k, k + 1) for k in range(2 * n, 2 * n + m))):
            block_of, other = found.A[n:][rows, columns], wanted[rows, columns]
            scale = max(np.abs(other).max(), 1e-2)  # smaller blocks are zero but for rounding
            assert np.abs(block_of - other).max() <= 1e-7 * scale, (rows, columns)
