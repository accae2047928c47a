"""Interfaces between integrators, compiled models and callers.

All calls are first-class numba functions of ONE fixed signature each, so a kernel that takes them by
`types.FunctionType` is compiled once, kept on disk, and serves every model. A model declares its functions with
`@njit(RATE, cache=True)` and so on. With the compiler off they are plain Python functions of the same arguments.

The trailing arguments `table, pool, work` are the model's own arrays. `work` is scratch: no call may rely on what an
earlier one left there. Outputs are written in place, every entry.

FIRST-ORDER CALL (every model)

    RATE       rate(t, x, dxdt, table, pool, work)
               dxdt = f(t, x), both (n_x,).

CONSTRAINTS (models that have them; the others offer None)

    PROJECT    project(t, x, table, pool, work) -> float
               Projects x (n_x,) onto the constraints in place, by the smallest change; returns the largest remaining
               residual relative to its tolerance. Called on every step's end and on every output row: the change is
               of the size of the local error. A step whose end leaves more than 1 is not accepted. The rate of such
               a model, and its residual, give the motion of the constrained system on and off the constraints.
CHANGE OF COORDINATES (models whose rotation sets need one)

    SWITCH     switch(t, x, table, pool, work) -> number of changes
               replaces coordinates in x that are close to a singularity by others of the same motion, in place; called
               before every step. A second call changes nothing. udot is not affected by a change. It receives every
               accepted state, and may record the one closest to a singularity in `work`; no integrator reads this.

SECOND-ORDER CALLS (models that offer the implicit methods). There x = (q, u, z) with q (n_q,), u (n_u,) and states z
(n_z,) of first order, none unless the model says so, n_x = n_q + n_u + n_z; n_q may exceed n_u (Euler parameters).
v = (u, z) (n_v,) comes in one array. Quasi-coordinate increments are (n_u,), like u.

    CORRECT    correct(t, q, v, vdot, out, c_damp, c_stiff, table, pool, work)
               out (n_v,): what Newton's method adds to vdot; zero along the motion. Of u it is
               -(M(q, t) + c_damp D + c_stiff K)^-1 (M udot + h(q, v, t) - Q(q, v, t)), of z
               (1 - c_damp J)^-1 (f(q, v, t) - zdot). D and K: the linear dampers and springs of modes and joints,
               in quasi-coordinates; approximations of -dQ/du, -dQ/dq and J = df/dz are enough (they set the speed of
               Newton's method, never the answer).
    KINEMATIC  kinematic(t, q, u, qdot, table, pool, work)
               qdot = N(q) u, (n_q,), linear in u.

Stage values may carry Euler parameters that are off unit length by the size of the local error; the calls must not
mind (normalise inside, or use formulas of degree zero).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Protocol, runtime_checkable

from femflex.arrays import Array, IntArray
from femflex.integrate.compiled import INDICES, INTEGER, REAL, VECTOR, types
from femflex.integrate.outcome import Block, Solution

ModelArrays = tuple[IntArray, Array, Array]
Call = Callable[..., Any]

_MODEL_ARRAYS = (INDICES, VECTOR, VECTOR)  # table, pool, work

RATE = types.void(REAL, VECTOR, VECTOR, *_MODEL_ARRAYS)
PROJECT = REAL(REAL, VECTOR, *_MODEL_ARRAYS)
CORRECT = types.void(REAL, VECTOR, VECTOR, VECTOR, VECTOR, REAL, REAL, *_MODEL_ARRAYS)
KINEMATIC = types.void(REAL, VECTOR, VECTOR, VECTOR, *_MODEL_ARRAYS)
SWITCH = INTEGER(REAL, VECTOR, *_MODEL_ARRAYS)
MODEL_ARRAYS = types.Tuple(_MODEL_ARRAYS)  # the three arrays as kernels take them


class SecondOrder(Protocol):
    """The second-order calls of a model with x = (q, u, z); they share the model's table, pool and work.

    A model with states z also says how many, `n_z`.
    """

    @property
    def n_q(self) -> int:
        """Number of coordinates q."""

    @property
    def n_u(self) -> int:
        """Number of quasi-velocities u."""

    @property
    def correct(self) -> Call:
        """First-class function of signature CORRECT."""

    @property
    def kinematic(self) -> Call:
        """First-class function of signature KINEMATIC."""


class Model(Protocol):
    """A compiled model as integrators use it: one call, its arrays, and the times at which its motion is not smooth."""

    @property
    def n_x(self) -> int:
        """Number of states."""

    @property
    def rate(self) -> Call:
        """First-class function of signature RATE."""

    @property
    def table(self) -> IntArray:
        """Integers of the model, passed to every call."""

    @property
    def pool(self) -> Array:
        """Numbers of the model, passed to every call."""

    @property
    def work(self) -> Array:
        """Scratch of the model, passed to every call."""

    @property
    def renormalise(self) -> IntArray:
        """Positions in x where four Euler parameters start; they are brought to unit length after each step."""

    @property
    def breaks(self) -> Array:
        """Ascending times where the rate or a derivative of it jumps (table knots, pulses); no step straddles one."""

    @property
    def switch(self) -> Call | None:
        """First-class function of signature SWITCH, or None if the coordinates never change."""

    @property
    def project(self) -> Call | None:
        """First-class function of signature PROJECT, or None for a model without constraints."""

    @property
    def second_order(self) -> SecondOrder | None:
        """The second-order calls, or None if the model has only its rate."""

    # A model may also have `motion_scales(x0, begin, end)`: sizes of its states, which absolute tolerances are measured
    # by; `clock` (see Clock); `events` (see femflex.integrate.events): instants at which its state
    # jumps; and `diagnosis` (see femflex.integrate.outcome): what it says of a state at which a method was stuck.


class Clock(Protocol):
    """Changes of a model's state at instants that the state itself contains, such as samples of controllers.

    A step ends at every such instant; an output row at that time shows the state before the change.
    """

    def next_instant(self, x: Array) -> float:
        """The next instant after the state x (n_x,) [s]."""

    def sample(self, t: float, x: Array) -> None:
        """Change x (n_x,) in place; the next instant lies behind t afterwards."""


Progress = Callable[[float], object]  # called with the time reached; a true answer stops the run


@runtime_checkable
class Integrator(Protocol):
    """A method of solution: frozen settings, no memory of any run.

    `blocks` is the working form: a generator of `Block(times, states, resume)`, each about 1024 rows or 0.2 s of
    work, whichever is first (so a block may hold no row at all). Saving `resume` with the rows and handing it back as
    `state` continues the run; `solve` collects the blocks.
    """

    @property
    def name(self) -> str:
        """Name in the register INTEGRATORS."""

    @property
    def order(self) -> int:
        """Order of the global error in the step size."""

    def blocks(self, model: Model, times: Array, x0: Array, state: Array | None = None) -> Iterator[Block]:
        """Blocks of the states at `times` (n_t,), ascending; x0 is the state at times[0]."""

    def solve(
        self, model: Model, times: Array, x0: Array, progress: Progress | None = None, state: Array | None = None
    ) -> Solution:
        """All states at `times` in one object."""
