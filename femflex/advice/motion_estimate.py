"""Motion estimate before a run: a preliminary rigid-body simulation, and the small elastic response to it.

The rigid-body simulation includes all loads, prescribed motions, springs and stops of the run, and so the spin that
torques reach and the acceleration of a free craft. It has no fast vibration, and costs a small part of the run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femflex.advice.elastic_motion import ElasticResponse, elastic_response
from femflex.advice.limits import (
    ESTIMATE_ROWS,
    ESTIMATE_RTOL,
    LOOP_FACTOR,
    MANY_COORDINATES,
    MOST_RATES,
    MOST_ROWS,
    PARTS,
    PER_PERIOD,
)
from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.dynamics import Model, compile_system
from femflex.dynamics.joints.places import prescribed_states
from femflex.dynamics.ledger.without import with_rigid_bodies
from femflex.dynamics.motion.freedoms import elastic_places
from femflex.integrate import Dop853, IntegrationError
from femflex.integrate.driver import ABSOLUTE, collected
from femflex.integrate.outcome import Block
from femflex.reading import error_text
from femflex.system import System

Motion = tuple[Array, Array]  # times (n_t,) and states (n_t, n_x)

SINGULAR = "a matrix of the model is singular or not finite"  # instead of the message of a library
RESPONSE_TIMES = np.arange(1, 9) / 8  # periods of the slowest vibration, after each jump of a load


@dataclass(frozen=True, eq=False)
class RigidEstimate:
    """Estimated motion of a system with all its bodies rigid.

    system  of rigid bodies     times  (n_t,) [s]     states (n_t, n_x) of its model
    shortfall  why it covers less than the whole time, and how much; empty for the whole
    """

    system: System
    times: Array
    states: Array
    shortfall: str = ""


@dataclass(frozen=True, eq=False)
class MotionEstimate:
    """Estimated motion of a system.

    times    (n_t,) [s]
    rigid_states    (n_t, n_x) states of the model in the rigid-body motion, elastic coordinates zero
    elastic_states  (n_t, n_x) the same with the elastic response
    shortfall  why it covers less than the whole time, and how much; empty for the whole
    rigid      the rigid-body motion that it is based on; None where there is none
    response   of the elastic bodies, mode by mode; None where it is not estimated
    """

    model: Model
    times: Array
    rigid_states: Array
    elastic_states: Array
    shortfall: str = ""
    rigid: RigidEstimate | None = None
    response: ElasticResponse | None = None


def estimate_motion(system: System, end: float) -> MotionEstimate:
    """Estimated motion of a system up to a time [s], or up to where the estimate costs too much."""
    system = replace(system, reactions=False, sights=())
    model = compile_system(system)
    initial = MotionEstimate(model, np.zeros(1), model.x0[None], model.x0[None])
    try:
        rigid = rigid_motion_of(model, end)
        states, rates = _states_from_rigid_motion(model, compile_system(rigid.system), (rigid.times, rigid.states))
    except (ValueError, np.linalg.LinAlgError) as error:
        return replace(initial, shortfall=f"for the initial state only ({_error_text(error)})")
    estimate = MotionEstimate(model, rigid.times, states, states, rigid.shortfall, rigid)
    if model.n_u > MANY_COORDINATES:
        return replace(
            estimate, shortfall=f"without elastic deflection ({model.n_u} coordinates, over {MANY_COORDINATES})"
        )
    try:
        response = elastic_response(model, rigid.times, states, rates)
    except (ValueError, np.linalg.LinAlgError) as error:
        return replace(estimate, shortfall=f"without elastic deflection ({_error_text(error)})")
    return replace(estimate, elastic_states=response.states, response=response)


def estimate_rigid_motion(system: System, end: float) -> tuple[RigidEstimate | None, str]:
    """The motion of a system with all bodies rigid up to that time [s]; or None, and the reason."""
    try:
        return rigid_motion_of(compile_system(replace(system, reactions=False, sights=())), end), ""
    except (ValueError, np.linalg.LinAlgError) as error:
        return None, f"for the initial state only ({_error_text(error)})"


def rigid_motion_of(model: Model, end: float) -> RigidEstimate:
    """The motion of a model with all bodies rigid up to that time [s], or up to where it costs too much.

    Raises ValueError or LinAlgError where the bodies cannot be rigid.
    """
    system = with_rigid_bodies(model.system, set(model.system.bodies))
    rigid = compile_system(system)
    (times, states), shortfall = _rigid_motion_at(rigid, estimate_times(model, end))
    return RigidEstimate(system, times, prescribed_states(rigid, times, states), shortfall)


def _error_text(error: Exception) -> str:
    """The message of an error, in femflex's own words."""
    return error_text(error, SINGULAR)


def estimate_times(model: Model, end: float) -> Array:
    """Times (n_t,) [s] of the estimate: uniform, denser for prescribed sines, at jumps of loads and shortly after."""
    sines = [
        profile.sines[:, 1].max(initial=0.0) for joint in model.system.joints for profile in joint.prescribed.values()
    ]
    turns = max(sines, default=0.0) * end / (2.0 * np.pi)
    rows = ESTIMATE_ROWS if model.constraints is None else ESTIMATE_ROWS // LOOP_FACTOR
    times = np.linspace(0.0, end, int(np.clip(PER_PERIOD * turns, rows, MOST_ROWS)))
    jumps = model.breaks[(model.breaks >= 0.0) & (model.breaks < end)]
    jumps = jumps[:: max(1, len(jumps) // ESTIMATE_ROWS)]
    period = max((T for body in model.system.bodies.values() for T in shape_periods(body)), default=0.0)
    near_jumps = [jumps - 1e-9 * end, jumps, jumps + 1e-9 * end, (jumps[1:] + jumps[:-1]) / 2]
    if len(jumps) < ESTIMATE_ROWS // len(RESPONSE_TIMES):
        near_jumps.append((np.append(jumps, 0.0)[:, None] + period * RESPONSE_TIMES).ravel())
    all_times = np.unique(np.concatenate([times, *near_jumps]))
    return all_times[(all_times >= 0.0) & (all_times <= end)]


def shape_periods(body: FlexibleBody) -> list[float]:
    """Periods of the shapes of a clamped body [s]."""
    stiffness, mass = np.diag(body.strain.V1), np.diag(body.without_slaves().moments.elastic_mass())
    return [2.0 * np.pi * float(np.sqrt(m / k)) for k, m in zip(stiffness, mass, strict=True) if k > 0.0]


def _rigid_motion_at(rigid: Model, times: Array) -> tuple[Motion, str]:
    """Times and states of the rigid bodies, up to where the motion costs too much or fails; and text on the reason."""
    if not rigid.n_x:
        return (times, np.zeros((len(times), 0))), ""
    sizes = rigid.motion_scales(rigid.x0, float(times[0]), float(times[-1]))
    method = Dop853(rtol=ESTIMATE_RTOL, atol=ABSOLUTE * ESTIMATE_RTOL * sizes)
    parts: list[Motion] = []
    resume = None
    for part in np.array_split(times, PARTS):
        try:
            solution = collected(_affordable(method.blocks(rigid, part, rigid.x0, resume)), None, rigid.n_x)
        except TooExpensive:
            reached = parts[-1][0][-1] if parts else times[0]
            return _joined_motion(parts or [(times[:1], rigid.x0[None])]), _cost_limit_text(reached)
        except IntegrationError as error:
            parts.append((error.times, error.states))
            return _joined_motion(parts), f"up to t = {error.t:.4g} s only, where the rigid-body simulation fails"
        parts.append((solution.times, solution.states))
        resume = solution.resume
        if solution.steps.evaluations > MOST_RATES and part[-1] < times[-1]:
            return _joined_motion(parts), _cost_limit_text(part[-1])
    return _joined_motion(parts), ""


class TooExpensive(Exception):
    """Raised where one part of the motion takes ten times the evaluations allowed for the whole motion."""


def _affordable(blocks: Iterator[Block]) -> Iterator[Block]:
    """The blocks, up to ten times MOST_RATES evaluations; a spin of 1e9 rad/s would take more."""
    for block in blocks:
        if block.steps.evaluations > 10 * MOST_RATES:
            raise TooExpensive
        yield block


def _cost_limit_text(reached: float) -> str:
    return f"up to t = {reached:.4g} s only, to limit its cost"


def _joined_motion(parts: Sequence[Motion]) -> Motion:
    times, states = (np.concatenate(side) for side in zip(*parts, strict=True))
    return times, states


def _states_from_rigid_motion(model: Model, rigid: Model, motion: Motion) -> tuple[Array, Array]:
    """States (n_t, n_x) and accelerations (n_t, n_u) [SI] of the model in the rigid motion, undeformed."""
    qe, ue = elastic_places(model)
    q, u = np.delete(np.arange(model.n_q), qe), np.delete(np.arange(model.n_u), ue)
    times, rigid_states = motion
    states, rates = np.zeros((len(times), model.n_x)), np.zeros((len(times), model.n_u))
    states[:, q], states[:, model.n_q + u], states[:, model.n_q + model.n_u :] = rigid.parts(rigid_states)
    for row, t, x in zip(rates, times, rigid_states, strict=True):
        row[u] = rigid.parts(rigid.state_rate(float(t), x))[1]
    return states, rates
