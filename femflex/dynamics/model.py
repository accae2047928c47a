"""The compiled System: flat arrays, the compiled calls over them, and what a run of it reports."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from femflex.dynamics import equations, monitors
from femflex.dynamics import observe as seen
from femflex.dynamics.joint_channels import ball_channels, observe_balls
from femflex.dynamics.layout import BALL_MODIFIED, BALL_QUATERNION, body_records
from femflex.dynamics.lower import aligned, lower, reported_markers
from femflex.rotations import is_extrinsic, is_symmetric, letters_of
from femflex.system import Channel, System

if TYPE_CHECKING:
    from femflex.dynamics.second_order import SecondOrderCalls

Array = NDArray[np.float64]

XYZ = ("x", "y", "z")
EULER = ("e0", "e1", "e2", "e3")
ANGLE_WORDS = {"x": "pitch", "y": "yaw", "z": "roll"}  # about the orbit normal, the vertical, the flight direction


@dataclass(frozen=True, eq=False)
class Model:
    """A System lowered to flat arrays; `rate(t, x, dx, table, pool, work)` is its compiled equation of motion.

    table, pool, work   see femflex.dynamics.layout
    x0                  (n_x,) initial state (q, u)
    breaks              (n,) times at which a load is not smooth [s]
    renormalise         first positions in x of the quadruples of Euler parameters
    channels            path -> Channel of everything `observe` returns
    omitted             what `without` has switched off
    """

    system: System
    table: NDArray[np.int64]
    pool: Array
    work: Array
    n_q: int
    n_u: int
    x0: Array
    breaks: Array
    renormalise: NDArray[np.int64]
    channels: dict[str, Channel]
    rate: Any = field(default=equations.rate)
    omitted: tuple[str, ...] = ()

    @property
    def n_x(self) -> int:
        """Number of states."""
        return self.n_q + self.n_u

    @property
    def second_order(self) -> SecondOrderCalls:
        """The calls of implicit integrators; compiled when first asked for."""
        from femflex.dynamics.second_order import SecondOrderCalls

        if self.rate is equations.rate:
            return SecondOrderCalls(self.n_q, self.n_u)
        from femflex.dynamics.reduced import reduced_residual

        return SecondOrderCalls(self.n_q, self.n_u, reduced_residual)

    @property
    def switch(self) -> Any:
        """The call that changes coordinates between two steps, or None where no rotation set asks for it."""
        records = body_records(self.table)
        if not np.any((records["ball"] == BALL_MODIFIED) | (records["reference"] > 0)):
            return None
        from femflex.dynamics.switching import switch

        return switch

    @cached_property
    def max_frequency(self) -> float:
        """Highest natural frequency of shapes and springs at the initial configuration [rad/s]."""
        return highest_frequency(self)

    def state_rate(self, t: float, x: Array) -> Array:
        """dx/dt (n_x,) at the state x (n_x,)."""
        dx = np.empty(self.n_x)
        self.rate(float(t), np.ascontiguousarray(x, float), dx, self.table, self.pool, self.work)
        return dx

    def residual(self, t: float, x: Array, udot: Array) -> Array:
        """M udot + h - Q of eq. (9), (n_u,)."""
        out = np.empty(self.n_u)
        q, u = np.ascontiguousarray(x[: self.n_q], float), np.ascontiguousarray(x[self.n_q :], float)
        self.second_order.residual(
            float(t), q, u, np.ascontiguousarray(udot, float), out, self.table, self.pool, self.work
        )
        return out

    def bias(self, t: float, x: Array) -> Array:
        """h - Q of eq. (9), (n_u,)."""
        return self.residual(t, x, np.zeros(self.n_u))

    def mass_matrix(self, t: float, x: Array) -> Array:
        """M of eq. (9), (n_u, n_u)."""
        h = self.bias(t, x)
        return np.column_stack([self.residual(t, x, unit) - h for unit in np.eye(self.n_u)])

    def terms(self, times: Array, states: Array) -> dict[str, Array]:
        """Every term of eq. (9) at times (n_t,) and states (n_t, n_x): name -> (n_t, n_u). See `dynamics.terms`."""
        from femflex.dynamics.terms import terms

        return terms(self, times, states)

    def without(self, *names: str) -> Model:
        """A model with terms, loads or flexibility switched off by name. See `dynamics.without`."""
        from femflex.dynamics.without import without

        return without(self, *names)

    def observe(self, times: Array, states: Array) -> dict[str, Array]:
        """Every channel at times (n_t,) and states (n_t, n_x): path -> (n_t, *channel.shape)."""
        times = np.ascontiguousarray(times, float)
        states = np.ascontiguousarray(states, float)
        rows = np.empty((len(times), row_length(self.system)))
        seen.observe(times, states, rows, self.table, self.pool, self.work)
        out = {
            path: rows[:, place].reshape(len(times), *self.channels[path].shape)
            for path, place in row_places(self.system).items()
        }
        out["q"], out["u"] = states[:, : self.n_q], states[:, self.n_q :]
        out |= observe_balls(self.system, states)
        if is_extrinsic(self.system.libration_sequence):
            out["attitude/angles"] = out["attitude/angles"][:, ::-1]
        records = body_records(self.table)
        for i, name in enumerate(self.system.order, start=1):
            first = int(records[i]["qe"])
            out[f"bodies/{name}/delta"] = states[:, first : first + self.system.bodies[name].n_modes]
        return {path: out[path] for path in self.channels}


def compile_system(system: System) -> Model:
    """The compiled model of a system.

    The first process on a machine compiles the kernels once (some ten seconds); later ones load them.
    """
    table, pool, scratch = lower(system)
    n_q = len(system.coordinate_names())
    n_u = len(system.velocity_names())
    quadruples = [int(b["q"] + b["n_slide"]) for b in body_records(table)[1:] if b["ball"] == BALL_QUATERNION]
    knots = [load.times for load in system.loads if load.times is not None]
    return Model(
        system=system,
        table=table,
        pool=pool,
        work=aligned(scratch),
        n_q=n_q,
        n_u=n_u,
        x0=system.initial_state(),
        breaks=np.unique(np.concatenate(knots)) if knots else np.zeros(0),
        renormalise=np.array(quadruples, np.int64),
        channels=channels_of(system),
    )


def highest_frequency(model: Model) -> float:
    """Highest natural frequency of shapes and springs at the initial configuration, at rest [rad/s].

    M^-1 K column by column: the accelerations that a unit of each elastic, sliding or turning coordinate calls up.
    """
    pairs = [pair for record in body_records(model.table)[1:] for pair in stiff_coordinates(record)]
    if not pairs:
        return 0.0
    q, u = (np.array(side) for side in zip(*pairs, strict=True))
    rest = np.concatenate([model.x0[: model.n_q], np.zeros(model.n_u)])
    base = model.state_rate(0.0, rest)[model.n_q :][u]
    columns = []
    for j in q:
        moved = rest.copy()
        moved[j] += 1e-6
        columns.append((base - model.state_rate(0.0, moved)[model.n_q :][u]) / 1e-6)
    return float(np.sqrt(max(np.linalg.eigvals(np.column_stack(columns)).real.max(), 0.0)))


def stiff_coordinates(record: np.void) -> list[tuple[int, int]]:
    """(q, u) places of a body's elastic coordinates, and of its joint's slides and turns when it has springs."""
    joint = int(record["n_slide"] + record["n_turn"]) if record["sprung"] else 0
    elastic = [(int(record["qe"]) + k, int(record["ue"]) + k) for k in range(int(record["n"]))]
    return [(int(record["q"]) + k, int(record["u"]) + k) for k in range(joint)] + elastic


def row_length(system: System) -> int:
    """Numbers per observed instant."""
    counts = len(system.bodies) * seen.ROW_BODY + len(reported_markers(system)) * seen.ROW_MARKER
    return monitors.ROW_FIXED + counts + len(system.loads) * seen.ROW_LOAD


def row_places(system: System) -> dict[str, slice | int]:
    """Where each channel stands in an observed row."""
    s = monitors
    places: dict[str, slice | int] = {
        "attitude/angles": slice(s.ROW_ANGLES, s.ROW_ANGLES + 3),
        "monitors/energy": s.ROW_ENERGY,
        "monitors/kinetic": s.ROW_KINETIC,
        "monitors/elastic": s.ROW_ELASTIC,
        "monitors/spring": s.ROW_SPRING,
        "monitors/momentum": slice(s.ROW_MOMENTUM, s.ROW_MOMENTUM + 3),
        "monitors/angular_momentum": slice(s.ROW_ANGULAR, s.ROW_ANGULAR + 3),
        "monitors/center_of_mass": slice(s.ROW_CENTER, s.ROW_CENTER + 3),
        "monitors/quaternion_norm": s.ROW_NORM,
    }
    if system.orbit is not None:
        places |= {
            "orbit/radius": s.ROW_RADIUS,
            "orbit/true_anomaly": s.ROW_ANOMALY,
            "orbit/attitude": slice(s.ROW_ORBIT, s.ROW_ORBIT + 4),
            "monitors/gravity": s.ROW_GRAVITY,
            "monitors/jacobi": s.ROW_JACOBI,
        }
    at = s.ROW_FIXED
    for name in system.order:
        for key, start, stop in (("position", 0, 3), ("attitude", 3, 7), ("rate", 7, 10)):
            places[f"bodies/{name}/{key}"] = slice(at + start, at + stop)
        at += seen.ROW_BODY
    for body, marker in reported_markers(system):
        for key, start in (("position", 0), ("velocity", 3), ("deflection", 6)):
            places[f"markers/{body}.{marker}/{key}"] = slice(at + start, at + start + 3)
        at += seen.ROW_MARKER
    for load in system.loads:
        for key, start in (("force", 0), ("torque", 3)):
            places[f"loads/{load.name}/{key}"] = slice(at + start, at + start + 3)
        at += seen.ROW_LOAD
    return places


def channels_of(system: System) -> dict[str, Channel]:
    """Path, unit, meaning and frame of everything a run reports."""
    q, u = system.coordinate_names(), system.velocity_names()
    where = "from O" if system.orbit else "from the inertial origin"
    sequence = system.libration_sequence
    angles, kind = letters_of(sequence), "extrinsic" if is_extrinsic(sequence) else "intrinsic"
    words = tuple(f"{a}{k + 1}" if is_symmetric(sequence) else ANGLE_WORDS[a] for k, a in enumerate(angles))
    out = {
        "q": Channel(_units(q), "coordinates", (len(q),), tuple(name for name, _ in q)),
        "u": Channel(_units(u), "quasi-velocities", (len(u),), tuple(name for name, _ in u)),
        "attitude/angles": Channel(
            "rad", f"attitude of {system.root} from the {system.frame.kind} frame, {kind} {angles}", (3,), words
        ),
        "monitors/energy": Channel("J", "total energy"),
        "monitors/kinetic": Channel("J", "kinetic energy relative to O" if system.orbit else "kinetic energy"),
        "monitors/elastic": Channel("J", "strain energy"),
        "monitors/spring": Channel("J", "energy of joint springs"),
        "monitors/momentum": Channel("kg m/s", "linear momentum", (3,), XYZ, "inertial"),
        "monitors/angular_momentum": Channel(
            "kg m^2/s", "angular momentum about the centre of mass", (3,), XYZ, "inertial"
        ),
        "monitors/center_of_mass": Channel("m", f"centre of mass {where}", (3,), XYZ, "inertial"),
        "monitors/quaternion_norm": Channel("1", "largest departure of Euler parameters from unit length"),
    }
    if system.orbit is not None:
        out |= {
            "orbit/radius": Channel("m", "distance of O from the Earth's centre"),
            "orbit/true_anomaly": Channel("rad", "true anomaly of O"),
            "orbit/attitude": Channel("1", "Euler parameters of the orbital frame, C_NO", (4,), EULER),
            "monitors/gravity": Channel("J", "energy of the gravity gradient"),
            "monitors/jacobi": Channel("J", "Jacobi integral, constant on a specified circular orbit"),
        }
    for name in system.order:
        out |= {
            f"bodies/{name}/position": Channel("m", f"origin of {name} {where}", (3,), XYZ, "inertial"),
            f"bodies/{name}/attitude": Channel("1", f"Euler parameters of {name}, C_NB", (4,), EULER),
            f"bodies/{name}/rate": Channel("rad/s", f"inertial rate of {name}", (3,), XYZ, "body"),
            f"bodies/{name}/delta": Channel(
                "kg^1/2 m", f"elastic coordinates of {name}", (system.bodies[name].n_modes,)
            ),
        }
    for body, marker in reported_markers(system):
        label = f"{body}.{marker}"
        out |= {
            f"markers/{label}/position": Channel("m", f"position of {label} {where}", (3,), XYZ, "inertial"),
            f"markers/{label}/velocity": Channel("m/s", f"velocity of {label} {where}", (3,), XYZ, "inertial"),
            f"markers/{label}/deflection": Channel("m", f"elastic displacement of {label}", (3,), XYZ, "body"),
        }
    out |= ball_channels(system)
    for load in system.loads:
        out |= {
            f"loads/{load.name}/force": Channel("N", f"force of {load.name}", (3,), XYZ, "body"),
            f"loads/{load.name}/torque": Channel("N m", f"torque of {load.name}", (3,), XYZ, "body"),
        }
    return out


def _units(pairs: list[tuple[str, str]]) -> str:
    return ", ".join(unit for _, unit in pairs)
