"""The compiled System: flat arrays, the compiled calls over them, and the channels of a run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from femflex.arrays import Array, IntArray
from femflex.dynamics.clock import Clock
from femflex.dynamics.constraints.assemble import assembled
from femflex.dynamics.constraints.constrained import Constraints, build_constraints
from femflex.dynamics.constraints.free_lengths import link_length_steps, link_lengths
from femflex.dynamics.constraints.projection import project
from femflex.dynamics.effector_states import (
    check_distances,
    has_events,
    sensor_problems,
    threshold_problems,
    with_linear_effectors,
    with_settled_starts,
    with_starts,
)
from femflex.dynamics.events import AllEvents, Latches, StateEvents
from femflex.dynamics.forces.force_term import force_terms
from femflex.dynamics.implicit.correction import correct
from femflex.dynamics.implicit.residual import residual, solve
from femflex.dynamics.joints.ball import switch
from femflex.dynamics.joints.coordinates import advance, kinematic
from femflex.dynamics.layout.constraints import characteristic_length
from femflex.dynamics.layout.lower import lower
from femflex.dynamics.layout.records import BALL_QUATERNION, body_records
from femflex.dynamics.ledger.by_source import SWITCHED, terms
from femflex.dynamics.ledger.without import resolve_name, without_named, without_reactions, without_terms
from femflex.dynamics.motion.motion_scale import highest_frequency, motion_scales
from femflex.dynamics.observe.diagnosis import diagnosis
from femflex.dynamics.rate.rate import link_stages, rate
from femflex.dynamics.report import Channels, Observation
from femflex.dynamics.user_functions import check_user_functions
from femflex.dynamics.workspace import Workspace
from femflex.summary import Rows, Summarised, listed
from femflex.system import Channel, LengthTable, System


@dataclass(frozen=True, eq=False)
class SecondOrderCalls:
    """The second-order calls over a model's own arrays, each compiled when it is first called.

    refusal  why implicit integrators cannot solve the model; "" where they can
    lengths  table of a model with free lengths
    """

    n_q: int
    n_u: int
    n_z: int = 0
    refusal: str = ""
    lengths: IntArray | None = None
    kinematic: Any = field(default=kinematic)
    advance: Any = field(default=advance)
    solve: Any = field(default=solve)
    residual: Any = field(default=residual)

    @property
    def correct(self) -> Any:
        """The call of signature CORRECT. Raises ValueError with the refusal."""
        if self.refusal:
            raise ValueError(self.refusal)
        if self.lengths is not None:
            link_length_steps(self.lengths)
        return correct


@dataclass(frozen=True, eq=False, repr=False)
class Model(Summarised):
    """A System lowered to flat arrays; `rate(t, x, dx, table, pool, work)` is its compiled equation of motion.

    Nothing in it changes once it is compiled. Its calls write to arrays of a Workspace: each thread has its own, and
    each run (`for_run`), so one model can run in many threads at once.

    workspace           the arrays of its calls: table, pool, work (see femflex.dynamics.layout.records)
    x0                  (n_x,) initial state (q, u, z)
    breaks              (n,) times at which a load or a prescribed motion is not smooth [s]
    renormalise         first positions in x of the quadruples of Euler parameters
    all_channels        channels and their reports, also those that are zero by construction
    omitted             what `without` has switched off
    constraints         loops and nonholonomic constraints, or None
    project             call that brings a state back onto them, or None (see femflex.integrate.protocol)
    """

    system: System
    workspace: Workspace
    n_q: int
    n_u: int
    n_z: int
    x0: Array
    breaks: Array
    renormalise: IntArray
    all_channels: Channels
    rate: Any = field(default=rate)
    omitted: tuple[str, ...] = ()
    constraints: Constraints | None = None
    project: Any = None

    def summary(self) -> tuple[str, Rows]:
        """Its system's summary, with the sizes of the compiled equations."""
        rows = [("states", f"{self.n_x}: {self.n_q} coordinates, {self.n_u} velocities, {self.n_z} of effectors")]
        rows += [("constraint rows", str(self.constraints.n_rows))] if self.constraints is not None else []
        rows += [("switched off", listed(self.omitted))] if self.omitted else []
        return "Compiled model", [*rows, ("channels", str(len(self.channels))), *self.system.summary()[1]]

    @cached_property
    def channels(self) -> dict[str, Channel]:
        """Path -> Channel of everything `observe` returns."""
        return self.all_channels.reported()

    @property
    def table(self) -> IntArray:
        """Records."""
        return self.workspace.table

    @property
    def pool(self) -> Array:
        """Numbers, as the calling thread has them."""
        return self.workspace.arrays[1]

    @property
    def work(self) -> Array:
        """Scratch of the calling thread."""
        return self.workspace.arrays[2]

    def for_run(self) -> Model:
        """The same model with scratch arrays of its own, for one run."""
        return self.with_workspace(self.workspace.new_scratch())

    def with_workspace(self, workspace: Workspace) -> Model:
        """The same model with other arrays."""
        constraints = None if self.constraints is None else replace(self.constraints, workspace=workspace)
        return replace(self, workspace=workspace, constraints=constraints)

    @property
    def n_x(self) -> int:
        """Number of states."""
        return self.n_q + self.n_u + self.n_z

    def parts(self, x: Array) -> tuple[Array, Array, Array]:
        """Views of q, u and z in states (..., n_x)."""
        n = self.n_q + self.n_u
        return x[..., : self.n_q], x[..., self.n_q : n], x[..., n:]

    def at_rest(self, q: Array) -> Array:
        """The state (n_x,) at coordinates q (n_q,) without velocities, its z as at the start."""
        return np.concatenate([q, np.zeros(self.n_u), self.parts(self.x0)[2]])

    @cached_property
    def second_order(self) -> SecondOrderCalls:
        """The calls of implicit integrators and studies."""
        free, reason = free_lengths(self.system), ""
        if free and self.constraints is not None:
            reason = "the system has loops or constraints, which implicit integrators cannot do together"
        elif free and self.reduced:
            reason = "terms of its equations are left out (`without`), which implicit integrators cannot do"
        text = f"body {free[0]!r} has a free length, and {reason}; set integrator = 'dop853'" if reason else ""
        return SecondOrderCalls(self.n_q, self.n_u, self.n_z, text, self.table if free else None)

    @cached_property
    def reduced(self) -> bool:
        """Whether the compiled equations leave terms out (see `dynamics.ledger.without`)."""
        return any(name in SWITCHED for name in self.omitted)

    @cached_property
    def with_linear_effectors(self) -> Model:
        """The model with effectors as linear models have them; itself where that changes none."""
        system = with_linear_effectors(self.system)
        return self if system is self.system else without_terms(compile_system(system), self.omitted)

    @property
    def switch(self) -> Any:
        """The call that watches and changes coordinates between two steps; None where no rotation set can fail."""
        if not np.any(body_records(self.table)["ball"] > BALL_QUATERNION):
            return None
        return switch

    @cached_property
    def events(self) -> AllEvents | Latches | None:
        """The latches of the joints and the events of effectors, or None where there are none."""
        has_latches, has_state_events = any(joint.latches for joint in self.system.joints), has_events(self.system)
        if not (has_latches or has_state_events):
            return None
        if not has_state_events:
            return Latches(self)
        return AllEvents((Latches(self), StateEvents(self)) if has_latches else (StateEvents(self),))

    @cached_property
    def clock(self) -> Clock | None:
        """The sampled controllers, or None where there are none."""
        if not self.system.controllers:
            return None
        return Clock(self)

    @cached_property
    def max_frequency(self) -> float:
        """Highest natural frequency of shapes and springs at the initial configuration [rad/s]."""
        return highest_frequency(self)

    def motion_scales(self, x0: Array, begin: float, end: float) -> Array:
        """Sizes (n_x,) of the states of a run from x0 (n_x,) between two times [s], for its absolute tolerances."""
        return motion_scales(self, x0, begin, end)

    def state_rate(self, t: float, x: Array) -> Array:
        """dx/dt (n_x,) at the state x (n_x,)."""
        self._refuse_short(x)
        dx = np.empty(self.n_x)
        self.rate(float(t), np.ascontiguousarray(x, float), dx, *self.workspace.arrays)
        return dx

    def residual(self, t: float, x: Array, udot: Array) -> Array:
        """M udot + h - Q of eq. (9), (n_u,), without forces of constraints; udot - sddot on prescribed rows."""
        self._refuse_short(x)
        out = np.empty(self.n_u)
        q, u = np.ascontiguousarray(x[: self.n_q], float), np.ascontiguousarray(x[self.n_q :], float)
        self.second_order.residual(float(t), q, u, np.ascontiguousarray(udot, float), out, *self.workspace.arrays)
        return out

    def gather(self, t: float, x: Array, udot: Array) -> None:
        """Leave in the work array the force of every joint (W_P) for the state x that moves on with udot (n_u,).

        The multipliers of constraints are those that `rate` solved for last. Raises AttributeError where these act and
        terms are left out.
        """
        if self.constraints is None:
            self.residual(t, x, udot)
            return
        if self.reduced:
            raise AttributeError("joint forces need all terms of the equations, and some are switched off (`without`)")
        with self.constraints.pushed():
            self.residual(t, x, udot)

    def _refuse_short(self, x: Array) -> None:
        """Raise ValueError for a state without its z: compiled code would read beyond its end."""
        if len(x) < self.n_x:
            raise ValueError(f"a state of this model has {self.n_x} numbers (q, u, z); found {len(x)}")

    def bias(self, t: float, x: Array) -> Array:
        """h - Q of eq. (9), (n_u,)."""
        return self.residual(t, x, np.zeros(self.n_u))

    def mass_matrix(self, t: float, x: Array) -> Array:
        """M of eq. (9), (n_u, n_u)."""
        h = self.bias(t, x)
        return np.array([self.residual(t, x, unit) - h for unit in np.eye(self.n_u)]).reshape(self.n_u, self.n_u).T

    def terms(self, times: Array, states: Array) -> dict[str, Array]:
        """Every term of eq. (9) at times (n_t,) and states (n_t, n_x): name -> (n_t, n_u).

        See `dynamics.ledger.by_source`.
        """
        return terms(self, times, states)

    def without(self, *names: str) -> Model:
        """Return the model without terms (see `terms`), loads, effectors (or a kind), flexibility or nonlinear strain.

        A rigid, undamped, unloaded ... system is one in which the thing is not there. The inertia forces by degree in u
        and gravity are left out of the compiled equations instead; the monitors of energy still count what they stand
        for. Raises ValueError for a name that is not known, with those that are.
        """
        resolved_names = tuple(dict.fromkeys(full for name in names for full in resolve_name(self, name)))
        system = self.system
        for name in resolved_names:
            system = without_named(system, name)
        omitted = (*self.omitted, *resolved_names)
        model = compile_system(without_reactions(system, omitted))
        if self.constraints is not None and model.n_x == self.n_x:
            model = replace(model, x0=self.x0)  # closed loops start where they did
        return without_terms(model, omitted)

    def diagnosis(self, t: float, x: Array, infeasible: bool = False) -> tuple[str, Exception | None]:
        """Return a sentence on a state at which a run ended, and the exception behind it."""
        return diagnosis(self, t, x, infeasible)

    def observe(self, times: Array, states: Array) -> dict[str, Array]:
        """Every channel at times (n_t,) and states (n_t, n_x): path -> (n_t, *channel.shape)."""
        observation = self.observation(times, states)
        return {path: observation[path] for path in self.channels}

    def observation(self, times: Array, states: Array) -> Observation:
        """As `observe`, also of channels that a run does not report, each computed when it is read."""
        return Observation(self, times, states)

    def channel_values(self, t: float, x: Array, paths: Iterable[str]) -> dict[str, Array]:
        """Single channels at the state x (n_x,), without all the others: path -> channel.shape."""
        observation = self.observation(np.array([t]), x[None])
        return {path: np.array(observation[path][0]) for path in paths}


def compile_system(system: System) -> Model:
    """The compiled model of a system.

    The first process on a machine compiles the kernels once (some ten seconds); later ones load them.
    Raises ValueError for an effector whose function cannot be compiled or leaves its arrays at the initial state, and
    for a sensor or a threshold that is no channel.
    """
    channels = Channels.of_system(system)
    reported = channels.reported()
    if problems := sensor_problems(system, reported) + threshold_problems(system, reported):
        raise ValueError("\n".join(problems))
    table, pool, scratch = lower(system, force_terms())
    link_stages(table)
    link_lengths(table)
    n_q = len(system.coordinate_names())
    n_u, n_z = len(system.velocity_names()), len(system.state_names())
    quadruples = [int(b["q"] + b["n_slide"]) for b in body_records(table)[1:] if b["ball"] == BALL_QUATERNION]
    knots = [times for term in force_terms() for times in term.breaks(system)]
    knots += [variation.breaks for variation in system.varying.values()]
    knots += [profile.breaks for joint in system.joints for profile in joint.prescribed.values()]
    tree = Model(
        system=system,
        workspace=Workspace(table, pool, scratch, bool(system.varying)),
        n_q=n_q,
        n_u=n_u,
        n_z=n_z,
        x0=system.initial_state(),
        breaks=np.unique(np.concatenate(knots)) if knots else np.zeros(0),
        renormalise=np.array(quadruples, np.int64),
        all_channels=channels,
    )
    model = with_starts(with_constraints(tree) if system.loops or system.constraints else tree)
    model = with_settled_starts(model)
    check_distances(model)
    check_user_functions(model)
    return model


def free_lengths(system: System) -> list[str]:
    """Names of the deploying bodies whose length is a state."""
    tables = {name: variation.write for name, variation in system.varying.items()}
    return [name for name, t in tables.items() if isinstance(t, LengthTable) and isinstance(t.length, str)]


def with_constraints(tree: Model) -> Model:
    """Return the model with its loops closed and its constraints met, started from the nearest consistent state.

    Raises ValueError for a loop that cannot close.
    """
    constraints = build_constraints(tree.system, tree.workspace, tree.n_q, tree.n_u)
    x0 = assembled(constraints, tree.x0, characteristic_length(tree.system), tree.mass_matrix)
    tree.workspace.store_numbers()  # what play was taken up, and which pivots are lost
    return replace(tree, constraints=constraints, x0=x0, project=project)
