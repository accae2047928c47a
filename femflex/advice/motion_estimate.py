"""Motion estimate before a run: a preliminary rigid-body simulation, and the small elastic response to it.

The rigid motion goes through all loads, specified motions, springs and stops to come, and knows the spin that torques
reach and the way that a craft gives; it has no fast vibration, and so costs a small part of the run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femflex.advice.limits import MANY, MOST_RATES
from femflex.arrays import Array
from femflex.body import FlexibleBody
from femflex.dynamics import Model, compile_system
from femflex.dynamics.equilibria.elastic_response import ElasticResponse, elastic_places, elastic_response
from femflex.dynamics.joints.held_places import specified_states
from femflex.dynamics.terms.without import stiffened
from femflex.integrate import Dop853, IntegrationError
from femflex.integrate.driver import ABSOLUTE, collected
from femflex.integrate.outcome import Block
from femflex.reading import error_text
from femflex.system import System

Motion = tuple[Array, Array]  # times (n_t,) and states (n_t, n_x)

SINGULAR = "a matrix of the model is singular or not finite"  # instead of what libraries say of it
RTOL = 1e-6  # of the rigid motion
ROWS = 2000  # spread over the time looked at
CLOSED = 4  # times fewer of them where loops have to be solved for in each
PER_PERIOD = 12  # rows for each period of specified sines
MOST_ROWS = 12_000
AFTER = np.arange(1, 9) / 8  # of the slowest vibration's period, after whatever comes suddenly
PARTS = 64  # the motion is computed part by part, until MOST_RATES rates are spent


@dataclass(frozen=True, eq=False)
class RigidEstimate:
    """Estimated motion of a system with all its bodies rigid.

    system  of rigid bodies     times  (n_t,) [s]     states (n_t, n_x) of its model
    short   why it covers less than the whole time, and how much; empty for the whole
    """

    system: System
    times: Array
    states: Array
    short: str = ""


@dataclass(frozen=True, eq=False)
class MotionEstimate:
    """Estimated motion of a system.

    times    (n_t,) [s]
    carried  (n_t, n_x) states of the model moved as rigid bodies, elastic coordinates zero
    bent     (n_t, n_x) the same with their elastic response
    short    why it covers less than the whole time, and how much; empty for the whole
    rigid    the motion of rigid bodies that it is made from; None where there is none
    response  of the elastic bodies, mode by mode; None where it is not estimated
    """

    model: Model
    times: Array
    carried: Array
    bent: Array
    short: str = ""
    rigid: RigidEstimate | None = None
    response: ElasticResponse | None = None


def estimate_motion(system: System, until: float, rigid: RigidEstimate | None = None) -> MotionEstimate:
    """Estimated motion of a system up to a time [s], as far as it costs little.

    rigid: the motion of its rigid bodies, where it is known already, as of the same craft in another set of shapes.
    """
    system = replace(system, reactions=False, sights=())
    model = compile_system(system)
    start = MotionEstimate(model, np.zeros(1), model.x0[None], model.x0[None])
    try:
        rigid = rigid_motion_of(model, until) if rigid is None else rigid
        states, rates = _taken_along(model, compile_system(rigid.system), (rigid.times, rigid.states))
    except (ValueError, np.linalg.LinAlgError) as error:
        return replace(start, short=f"for the initial state only ({_first(error)})")
    moved = MotionEstimate(model, rigid.times, states, states, rigid.short, rigid)
    if model.n_u > MANY:
        return replace(moved, short=f"without elastic deflection ({model.n_u} coordinates, over {MANY})")
    try:
        response = elastic_response(model, rigid.times, states, rates)
    except (ValueError, np.linalg.LinAlgError) as error:
        return replace(moved, short=f"without elastic deflection ({_first(error)})")
    return replace(moved, bent=response.states, response=response)


def estimate_rigid_motion(system: System, until: float) -> tuple[RigidEstimate | None, str]:
    """The motion of a system's bodies as rigid ones until that time [s], or None and why there is none."""
    try:
        return rigid_motion_of(compile_system(replace(system, reactions=False, sights=())), until), ""
    except (ValueError, np.linalg.LinAlgError) as error:
        return None, f"for the initial state only ({_first(error)})"


def rigid_motion_of(model: Model, until: float) -> RigidEstimate:
    """The motion of a model's bodies as rigid ones until that time [s], as far as that costs little.

    Raises ValueError and LinAlgError where they cannot be rigid.
    """
    system = stiffened(model.system, set(model.system.bodies))
    rigid = compile_system(system)
    (times, states), short = _moved(rigid, estimate_times(model, until))
    return RigidEstimate(system, times, specified_states(rigid, times, states), short)


def _first(error: Exception) -> str:
    """What an error says, in femflex's own words."""
    return error_text(error, SINGULAR)


def estimate_times(model: Model, until: float) -> Array:
    """Times (n_t,) [s] of the estimate: spread out, denser under prescribed sines, at jumps and where responses
    oscillate."""
    sines = [profile.sines[:, 1].max(initial=0.0) for joint in model.system.joints for profile in joint.held.values()]
    turns = max(sines, default=0.0) * until / (2.0 * np.pi)
    rows = ROWS if model.constraints is None else ROWS // CLOSED
    times = np.linspace(0.0, until, int(np.clip(PER_PERIOD * turns, rows, MOST_ROWS)))
    jumps = model.breaks[(model.breaks >= 0.0) & (model.breaks < until)]
    jumps = jumps[:: max(1, len(jumps) // ROWS)]
    period = slowest_period(model)
    near_jumps = [jumps - 1e-9 * until, jumps, jumps + 1e-9 * until, (jumps[1:] + jumps[:-1]) / 2]
    if len(jumps) < ROWS // len(AFTER):
        near_jumps.append((np.append(jumps, 0.0)[:, None] + period * AFTER).ravel())
    found = np.unique(np.concatenate([times, *near_jumps]))
    return found[(found >= 0.0) & (found <= until)]


def slowest_period(model: Model) -> float:
    """Period of the slowest shape of all bodies [s], each held alone."""
    return max((period for body in model.system.bodies.values() for period in shape_periods(body)), default=0.0)


def shape_periods(body: FlexibleBody) -> list[float]:
    """Periods of the shapes of a body held alone [s]."""
    stiffness, mass = np.diag(body.strain.V1), np.diag(body.without_slaves().moments.elastic_mass())
    return [2.0 * np.pi * float(np.sqrt(m / k)) for k, m in zip(stiffness, mass, strict=True) if k > 0.0]


def _moved(rigid: Model, times: Array) -> tuple[Motion, str]:
    """The motion of rigid bodies at these times, or up to where it costs too much or runs away, and why."""
    if not rigid.n_x:
        return (times, np.zeros((len(times), 0))), ""
    sizes = rigid.motion_scales(rigid.x0, float(times[0]), float(times[-1]))
    method = Dop853(rtol=RTOL, atol=ABSOLUTE * RTOL * sizes)
    found: list[Motion] = []
    resume = None
    for part in np.array_split(times, PARTS):
        try:
            done = collected(_affordable(method.blocks(rigid, part, rigid.x0, resume)), None, rigid.n_x)
        except TooExpensive:
            reached = found[-1][0][-1] if found else times[0]
            return _joined(found or [(times[:1], rigid.x0[None])]), _dear(reached)
        except IntegrationError as error:
            found.append((error.times, error.states))
            return _joined(found), f"up to t = {error.t:.4g} s only, where the rigid-body simulation fails"
        found.append((done.times, done.states))
        resume = done.resume
        if done.steps.evaluations > MOST_RATES and part[-1] < times[-1]:
            return _joined(found), _dear(part[-1])
    return _joined(found), ""


class TooExpensive(Exception):
    """One part of the motion takes more rates than the whole may."""


def _affordable(blocks: Iterator[Block]) -> Iterator[Block]:
    """The blocks, until they have taken ten times what all parts may, as a spin of 1e9 rad/s does."""
    for block in blocks:
        if block.steps.evaluations > 10 * MOST_RATES:
            raise TooExpensive
        yield block


def _dear(reached: float) -> str:
    return f"up to t = {reached:.4g} s only, to limit its cost"


def _joined(parts: Sequence[Motion]) -> Motion:
    times, states = (np.concatenate(side) for side in zip(*parts, strict=True))
    return times, states


def _taken_along(model: Model, rigid: Model, motion: Motion) -> tuple[Array, Array]:
    """States and accelerations of the model, elastic ones zero, that move as the rigid model does."""
    qe, ue = elastic_places(model)
    q, u = np.delete(np.arange(model.n_q), qe), np.delete(np.arange(model.n_u), ue)
    times, found = motion
    states, rates = np.zeros((len(times), model.n_x)), np.zeros((len(times), model.n_u))
    states[:, q], states[:, model.n_q + u], states[:, model.n_q + model.n_u :] = rigid.parts(found)
    for row, t, x in zip(rates, times, found, strict=True):
        row[u] = rigid.parts(rigid.state_rate(float(t), x))[1]
    return states, rates
