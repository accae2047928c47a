"""The linear model of a case between its disturbances and the outputs of [jitter], and its response by modes.

Outputs are inertial motions of markers: a sensor measures the rate or the velocity, and division by i w makes an angle
or a displacement of it. A base that shakes is an input too: the craft moves relative to it as under a weight that is
minus the acceleration of the base.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import expm

from femflex.arrays import Array, ComplexArray
from femflex.case import Case
from femflex.disturbances import (
    BaseMotion,
    BaseVibration,
    JitterOutput,
    JitterTable,
    MarkerDisturbance,
    Source,
    WheelDisturbance,
)
from femflex.disturbances.disturbance import COMPONENTS, perpendicular
from femflex.effectors.constant_commands import with_held_commands
from femflex.effectors.sensor import Sensor
from femflex.effectors.wheel import P as WHEEL
from femflex.effectors.wheel import Rotor
from femflex.noun.problems import suggestion_text
from femflex.rotations import dcm_from_quaternion
from femflex.studies.linear import LinearModel, linear_model, poles_of, sampled_model
from femflex.studies.linear.inputs import BASE
from femflex.studies.linear.space import resolvent, resolvent_response
from femflex.system import Part, System
from femflex.system.acting import with_effectors
from femflex.warning import PhysicsWarning

UNSTABLE = "the loop of the sampled controllers has a multiplier on the unit circle at the response of {s:.6g}"


@dataclass(frozen=True, eq=False)
class SampledLoop:
    """Sampled controllers about the states x (n,) of a linear model.

    B (n, m)  of commands and memory s;  samples_x (m, n), samples_s (m, m): s after a sample from x and s before it
    period [s];  poles (k,) [1/s] of the closed loop below half the rate of the samples
    """

    B: Array
    samples_x: Array
    samples_s: Array
    period: float
    poles: ComplexArray

    def closed(self, A: ComplexArray, B: Array, C: Array, omega: Array) -> ComplexArray:
        """C x (n_omega, n_out, n_c) per component of a disturbance with columns B (n, n_c), at omega [rad/s]."""
        z = np.exp(1j * omega * self.period)
        n, m, n_c = len(A), self.B.shape[1], B.shape[1]
        wide = np.zeros((n + m, n + m), complex)
        wide[:n, :n], wide[:n, n:] = A, self.B
        flow = expm(wide * self.period)
        G = resolvent_response(A, np.hstack([B, self.B]), np.vstack([C, self.samples_x]), omega)
        to_outputs, to_samples = G[:, : len(C)], G[:, len(C) :, :n_c]
        sampled = resolvent(flow[:n, :n], flow[:n, n:], self.samples_x, z, lambda s: UNSTABLE.format(s=s))
        loop = np.eye(m) - self.samples_s / z[:, None, None] - sampled
        commands = np.linalg.solve(loop, to_samples)
        staircase = (1.0 - 1.0 / z) / (1j * omega * self.period)
        return np.asarray(to_outputs[..., :n_c] + staircase[:, None, None] * (to_outputs[..., n_c:] @ commands))


def sampled_loop(system: System, model: LinearModel) -> SampledLoop | None:
    """The sampled controllers of a system about its linear model, None without; warns of those that are held instead.

    Those of several periods or with delays have no discrete model.
    """
    if not with_held_commands(system, loops=False).controllers:
        return None
    try:
        discrete = sampled_model(system)
    except ValueError as error:
        warnings.warn(
            PhysicsWarning(f"commands of sampled controllers are held, so their loops are open: {error}"), stacklevel=3
        )
        return None
    names, n = [name for name, _ in discrete.states], len(model.A)
    place = np.array([names.index(name) for name, _ in model.states], int)
    others = np.setdiff1d(np.arange(len(names)), place)
    multipliers = discrete.multipliers()
    poles = np.log(multipliers[np.abs(multipliers) > 1e-12].astype(complex)) / discrete.period
    assert len(place) == n
    return SampledLoop(
        discrete.generator[np.ix_(place, others)],
        discrete.sample[np.ix_(others, place)],
        discrete.sample[np.ix_(others, others)],
        discrete.period,
        poles,
    )


XYZ = "xyz"
MEASURED = {  # of an output: kind of its sensor, power of i w, unit
    "pointing": ("rate", -1, "rad"),
    "rotation": ("rate", -1, "rad"),
    "displacement": ("velocity", -1, "m"),
    "velocity": ("velocity", 0, "m/s"),
    "acceleration": ("velocity", 1, "m/s^2"),
}
AMPLITUDES = "bodies/{body}/delta"
SAME = 1e-6  # relative change of the equilibrium with the speed of a wheel that does not count
ROUNDING = 1e-9  # of the largest singular value of a change of A
SENSOR, ROTOR = "jitter-sensor.", "jitter-rotor."


@dataclass(frozen=True, eq=False)
class Mode:
    """A mode of the response: its name, its pole [1/s] and residues (n_rows, n_in)."""

    name: str
    pole: complex
    residue: ComplexArray
    conjugate: ComplexArray
    conjugate_pole: complex

    @property
    def frequency(self) -> float:
        """Frequency [Hz]."""
        return float(self.pole.imag / (2.0 * np.pi))

    @property
    def damping_ratio(self) -> float:
        """Damping ratio."""
        return float(-self.pole.real / abs(self.pole))


@dataclass(frozen=True, eq=False)
class Spin:
    """Change of A with the speed of a rotor, A(speed) = A(first) + (speed - first) U V.

    first [rad/s];  U (n, r), V (r, n), r the rank of the change
    """

    first: float
    U: Array
    V: Array

    def change(self, speed: float) -> Array:
        """Change (n, n) of A at a speed [rad/s]."""
        return (speed - self.first) * (self.U @ self.V)


@dataclass(frozen=True, eq=False)
class Plant:
    """A linear model with disturbances as inputs and motions of markers as outputs.

    model    the linear model; its outputs are the rows of C
    A        (n, n) complex where there is structural damping
    sources  name -> disturbance
    inputs   name -> (n_in, n_c): columns of B of a source from its six components, or from that of a base
    outputs  names (n_out,), units, powers of i w, and weights (n_out, n_rows) of the rows of C
    base     (n_out, 3): acceleration of the base that adds to an output, inertial axes
    loop     sampled controllers, None without
    system   of the case, without sensors and rotors of its own;  equipped: with those sensors
    """

    model: LinearModel
    A: ComplexArray
    sources: Mapping[str, Source]
    inputs: Mapping[str, Array]
    names: tuple[str, ...]
    units: tuple[str, ...]
    powers: Array
    weights: Array
    base: Array
    case: Case
    system: System
    equipped: System
    loop: SampledLoop | None = None

    @property
    def table(self) -> JitterTable:
        """Table [jitter] of the case."""
        assert self.case.jitter is not None
        return self.case.jitter

    def spin(self, name: str, first: float, last: float) -> Spin | None:
        """Change of A between two speeds [rad/s] of a source, None for one whose rotor has no momentum.

        Warns if the equilibrium changes with the speed.
        """
        if not self.has_momentum(name):
            return None
        faster = _with_speeds(self.equipped, self.sources, {name: last})
        other = linear_model(faster, [], [self.model.outputs[0][0]])
        y0, own = other.y0, self.model.y0[:1]
        if np.abs(y0 - own).max(initial=0.0) > SAME * max(1.0, np.abs(own).max(initial=0.0)):
            warnings.warn(
                PhysicsWarning(
                    f"disturbance {name!r}: the equilibrium of the craft changes with the speed of the wheel; its "
                    "linear model is interpolated between the lowest and the highest speed. Give a narrower range of "
                    "speeds"
                ),
                stacklevel=2,
            )
        left, size, right = np.linalg.svd((other.A - self.model.A) / (last - first))
        rank = int(np.count_nonzero(size > ROUNDING * size.max(initial=0.0)))
        return Spin(first, left[:, :rank] * size[:rank], right[:rank])

    def has_momentum(self, name: str) -> bool:
        """Whether the speed of a source changes the model: whether it is a wheel whose rotor has momentum."""
        noun = self.sources[name]
        return isinstance(noun, WheelDisturbance) and (noun.wheel is not None or noun.inertia > 0.0)

    def response(
        self, frequencies: Array, source: str, spin: Spin | None = None, speeds: Array | None = None
    ) -> ComplexArray:
        """Response (n, n_out, n_c) of the outputs, in their units, to the components of a source at frequencies
        (n,) [Hz], with a rotor at speeds (n,) [rad/s]."""
        omega = 2.0 * np.pi * np.asarray(frequencies, float)
        G = self._solved(self.weights @ self.model.C, self.weights @ self.model.D, omega, source, spin, speeds)
        G = G * (1j * omega[:, None, None]) ** self.powers[:, None]
        return np.asarray(G + self._feedthrough(source), complex)

    def _feedthrough(self, source: str) -> Array:
        noun = self.sources[source]
        if isinstance(noun, BaseMotion):
            return (self.base @ noun.unit_direction)[:, None]
        return np.zeros((len(self.names), self.inputs[source].shape[1]))

    def modes(self) -> list[Mode]:
        """The vibration modes with their residues, by rising frequency; rigid motion and lags are none."""
        from scipy.linalg import eig

        values, left, right = (np.asarray(matrix, complex) for matrix in eig(self.A, left=True, right=True))
        scale = np.einsum("ik,ik->k", left.conj(), right)
        named = [pole for pole in poles_of(self.model) if not pole.rigid and pole.value.imag > 0]
        C, used, out = self.weights @ self.model.C, set[int](), []
        for pole in named:
            k = int(np.argmin(np.abs(values - pole.value) + np.where(values.imag > 0, 0.0, np.inf)))
            m = int(np.argmin(np.abs(values - values[k].conj())))
            if k in used or k == m:
                continue
            used |= {k, m}
            pair = [np.outer(C @ right[:, j], left[:, j].conj() @ self.model.B) / scale[j] for j in (k, m)]
            out.append(Mode(pole.name, complex(values[k]), pair[0], pair[1], complex(values[m])))
        return sorted(out, key=lambda mode: mode.frequency)

    def modal_response(self, mode: Mode, frequencies: Array, source: str) -> ComplexArray:
        """The part (n, n_out, n_c) of a mode in the response to a source at frequencies (n,) [Hz]."""
        s = 2j * np.pi * np.asarray(frequencies, float)
        first, second = mode.residue @ self.inputs[source], mode.conjugate @ self.inputs[source]
        G = first / (s - mode.pole)[:, None, None] + second / (s - mode.conjugate_pole)[:, None, None]
        return G * s[:, None, None] ** self.powers[:, None]

    def spectrum(self, frequencies: Array, source: str) -> Array:
        """One-sided spectral density (n, n_c) of a source in squared SI units per Hz, notched by its limit of force."""
        noun, density = self.sources[source], self.sources[source].spectrum(frequencies)
        if not isinstance(noun, BaseVibration) or noun.interface is None:
            return density
        rows = [name for name, _ in self.model.outputs]
        if noun.interface not in rows:
            raise ValueError(f"disturbance {source!r}: {noun.interface!r} is a vector; name a component, as in force:y")
        row = rows.index(noun.interface)
        force = self._rows_response([row], frequencies, source)[:, 0, :]
        return np.asarray(
            np.minimum(density, noun.force_limit(frequencies)[:, None] / np.maximum(np.abs(force) ** 2, 1e-300))
        )

    def _rows_response(
        self, rows: list[int], frequencies: Array, source: str, spin: Spin | None = None, speeds: Array | None = None
    ) -> ComplexArray:
        """Response (n, n_rows, n_c) of rows of the model at frequencies (n,) [Hz]."""
        omega = 2.0 * np.pi * np.asarray(frequencies, float)
        return self._solved(self.model.C[rows], self.model.D[rows], omega, source, spin, speeds)

    def _solved(
        self, C: Array, D: Array, omega: Array, source: str, spin: Spin | None, speeds: Array | None
    ) -> ComplexArray:
        """C (i w - A)^-1 B + D (n, n_out, n_c) for a source at w (n,) [rad/s], with a rotor at speeds (n,) [rad/s].

        The momentum of the rotor enters by the matrix inversion lemma.
        """
        B = self.model.B @ self.inputs[source]
        if spin is None or speeds is None:
            return self._resolved(B, C, omega) + D @ self.inputs[source]
        G = self._resolved(np.hstack([B, spin.U]), np.vstack([C, spin.V]), omega)
        n_out, n_c = len(C), B.shape[1]
        factor = (speeds - spin.first)[:, None, None]
        loop = np.eye(len(spin.V)) - factor * G[:, n_out:, n_c:]
        gained = factor * G[:, :n_out, n_c:] @ np.linalg.solve(loop, G[:, n_out:, :n_c])
        return np.asarray(G[:, :n_out, :n_c] + gained + D @ self.inputs[source])

    def _resolved(self, B: Array, C: Array, omega: Array) -> ComplexArray:
        """C (i w - A)^-1 B (n, n_out, n_c) at w (n,) [rad/s], with the loops of sampled controllers closed."""
        return resolvent_response(self.A, B, C, omega) if self.loop is None else self.loop.closed(self.A, B, C, omega)

    def amplitude_count(self, body: str) -> int:
        """Number of amplitudes of a body. Raises ValueError for one that is not in `stress` of [jitter]."""
        return len(self._amplitude_rows(body))

    def amplitudes(
        self, frequencies: Array, source: str, body: str, spin: Spin | None = None, speeds: Array | None = None
    ) -> ComplexArray:
        """Response (n, n_d, n_c) of the amplitudes of a body, in their units; arguments as of `response`."""
        return self._rows_response(self._amplitude_rows(body), frequencies, source, spin, speeds)

    def _amplitude_rows(self, body: str) -> list[int]:
        names, start = [name for name, _ in self.model.outputs], AMPLITUDES.format(body=body)
        rows = [k for k, name in enumerate(names) if name.startswith(f"{start}:")]
        if body not in self.table.stress or not rows:
            raise ValueError(f"the amplitudes of body {body!r} are not known; name a flexible body in jitter.stress")
        return rows


def jitter_plant(case: Case, bodies: Mapping[str, Part] | None = None) -> Plant:
    """The plant of a case with [jitter] and [disturbances], its automatic choices made; swept wheels at their lowest
    speeds.

    bodies: in place of those of the case. Raises CaseError and ValueError for a case without them, or that cannot
    be in equilibrium.
    """
    from femflex.pipeline.case_equilibrium import resolve_at_rest

    resolved = resolve_at_rest(case, bodies)
    return plant_of(resolved.system, resolved.case)


def plant_of(system: System, case: Case) -> Plant:
    """As `jitter_plant`, of a system that is built already."""
    table = case.jitter
    if table is None or not case.disturbances:
        missing = [f"[{key}]" for key, there in (("jitter", table), ("disturbances", case.disturbances)) if not there]
        raise ValueError(
            f"the case has no {' and no '.join(missing)}; give outputs in [jitter] and [disturbances.NAME]"
        )
    folder = case.path.parent
    sources: dict[str, Source] = {name: noun.read_from(folder) for name, noun in case.disturbances.items()}
    sensors = {
        f"{SENSOR}{name}": Sensor(kind=MEASURED[output.kind][0], body=output.body, marker=output.marker)
        for name, output in table.outputs.items()
        if output.kind is not None
    }
    interfaces = [noun.interface for noun in sources.values() if isinstance(noun, BaseVibration) and noun.interface]
    channels = [*interfaces, *(output.channel or "" for output in table.outputs.values())]
    wants_reactions = any(channel.startswith("joints/") for channel in channels)
    equipped = replace(with_effectors(system, sensors), reactions=system.reactions or wants_reactions)
    at_speeds = _with_speeds(equipped, sources, {})
    paths, inputs = _inputs(sources)
    rows = _Rows(table.outputs)
    amplitudes = [AMPLITUDES.format(body=body) for body in table.stress]
    model = linear_model(at_speeds, paths, list(dict.fromkeys([*rows.channels, *interfaces, *amplitudes])))
    A = model.A.astype(complex)
    if table.loss_factor:
        A = A + _structural(model, table.loss_factor)
    names, units, powers, weights = rows.outputs(model)
    base = _base_rows(model, table.outputs, names)
    loop = sampled_loop(at_speeds, model)
    return Plant(model, A, sources, inputs, names, units, powers, weights, base, case, system, equipped, loop)


def _with_speeds(system: System, sources: Mapping[str, Source], speeds: Mapping[str, float]) -> System:
    """The system whose wheels have the momentum of these speeds [rad/s], or of their own, or of their lowest."""
    z0, rotors, states = dict(system.z0), {}, dict(system.state_names())
    for name, noun in sources.items():
        if not isinstance(noun, WheelDisturbance):
            continue
        speed = speeds.get(name, noun.speed or (noun.rates or (0.0, 0.0))[0])
        if noun.wheel is not None:
            state = f"{noun.wheel}.momentum"
            if state not in states:
                raise ValueError(
                    f"disturbance {name!r} names the wheel {noun.wheel!r}; "
                    + suggestion_text(noun.wheel, [key.removesuffix(".momentum") for key in states if "." in key])
                )
            wheel = next(effector for effector in system.effectors if effector.name == noun.wheel)
            z0[state] = float(wheel.parameters[WHEEL.inertia]) * speed  # type: ignore[union-attr]
        elif noun.inertia:
            momentum = noun.inertia * speed
            rotors[f"{ROTOR}{name}"] = Rotor(body=noun.body, marker=noun.marker, axis=noun.axis, momentum=momentum)
    return with_effectors(replace(system, z0=z0), rotors)


def _inputs(sources: Mapping[str, Source]) -> tuple[list[str], dict[str, Array]]:
    """Paths of the inputs of a linear model, and how the components of each source enter them."""
    entries = {name: _entries(noun) for name, noun in sources.items()}
    paths = list(dict.fromkeys(path for rows, _ in entries.values() for path in rows))
    inputs = {}
    for name, (rows, columns) in entries.items():
        inputs[name] = np.zeros((len(paths), columns.shape[1]))
        inputs[name][[paths.index(path) for path in rows]] = columns
    return paths, inputs


def _entries(noun: Source) -> tuple[list[str], Array]:
    """Paths (n,) of the inputs that a source takes, and their shares (n, n_c) of its components."""
    if isinstance(noun, BaseMotion):
        return [f"{BASE}:{axis}" for axis in XYZ], noun.unit_direction[:, None]
    assert isinstance(noun, MarkerDisturbance)
    return [f"markers/{noun.body}.{noun.marker}/{component}" for component in COMPONENTS], np.eye(6)


class _Rows:
    """The channels that the outputs need, and the outputs as sums of them."""

    def __init__(self, outputs: Mapping[str, JitterOutput]) -> None:
        self._outputs = outputs
        self.channels: list[str] = []
        for name, output in outputs.items():
            if output.kind is not None:
                self.channels += [f"effectors/{SENSOR}{name}/{axis}" for axis in XYZ]
            elif output.channel is not None:
                self.channels.append(output.channel)

    def outputs(self, model: LinearModel) -> tuple[tuple[str, ...], tuple[str, ...], Array, Array]:
        """Names, units, powers of i w (n,) and weights (n, n_rows). Raises KeyError for parts that are no outputs."""
        rows = [name for name, _ in model.outputs]
        out: dict[str, tuple[str, int, Array]] = {}
        for name, output in self._outputs.items():
            if output.kind is not None:
                places = [rows.index(f"effectors/{SENSOR}{name}/{axis}") for axis in XYZ]
                _, power, unit = MEASURED[output.kind]
                for label, direction in _directions(output):
                    weights = np.zeros(len(rows))
                    weights[places] = direction
                    out[f"{name}:{label}"] = (unit, power, weights)
            elif output.channel is not None:
                for k, row in enumerate(rows):
                    if row == output.channel or row.startswith(f"{output.channel}:"):
                        label = name + row.removeprefix(output.channel)
                        out[label] = (model.outputs[k][1], 0, np.eye(len(rows))[k])
        for name, output in self._outputs.items():
            if output.parts:
                out[name] = self._sum(name, output, out)
        names = tuple(out)
        units = tuple(unit for unit, _, _ in out.values())
        powers = np.array([power for _, power, _ in out.values()])
        return names, units, powers, np.array([weights for _, _, weights in out.values()]).reshape(len(out), len(rows))

    @staticmethod
    def _sum(name: str, output: JitterOutput, known: Mapping[str, tuple[str, int, Array]]) -> tuple[str, int, Array]:
        for part in output.parts:
            if part not in known:
                raise KeyError(f"output {name!r} is a sum with {part!r}; {suggestion_text(part, known)}")
        kinds = {known[part][:2] for part in output.parts}
        if len(kinds) > 1:
            raise ValueError(
                f"output {name!r} adds {', '.join(output.parts)}, which are not of one unit; give like parts"
            )
        ((unit, power),) = kinds
        return unit, power, sum(factor * known[part][2] for part, factor in output.parts.items())  # type: ignore[return-value]


def _directions(output: JitterOutput) -> list[tuple[str, Array]]:
    """Labels and directions (3,) of the components of an output, marker axes."""
    if output.kind != "pointing":
        return list(zip(XYZ, np.eye(3), strict=True))
    axis = np.array(output.axis) / np.linalg.norm(output.axis)
    labels = "12"
    if np.abs(axis).max() > 1.0 - 1e-12:
        k = int(np.argmax(np.abs(axis)))
        labels = XYZ[(k + 1) % 3] + XYZ[(k + 2) % 3]
    return list(zip(labels, perpendicular(axis), strict=True))


def _base_rows(model: LinearModel, outputs: Mapping[str, JitterOutput], names: Sequence[str]) -> Array:
    """Acceleration of the base (n_out, 3), inertial axes, that adds to accelerations relative to it."""
    rows = np.zeros((len(names), 3))
    channels = model.model.observe(np.array([model.t]), model.x[None])
    for name, output in outputs.items():
        if output.kind == "acceleration":
            attitude = dcm_from_quaternion(channels[f"bodies/{output.body}/attitude"][0])
            orientation = model.model.system.bodies[str(output.body)].markers[output.marker].orientation
            for label, direction in _directions(output):
                rows[names.index(f"{name}:{label}")] = attitude @ orientation @ direction
    return rows


def _structural(model: LinearModel, loss_factor: float) -> ComplexArray:
    """Part (n, n) of A by structural damping: -M^-1 i eta K of the elastic coordinates, in 1/s and 1/s^2."""
    n = len(model.mass)
    elastic = np.array([".delta" in name for name, _ in model.states[:n]])
    K = np.where(elastic[:, None] & elastic[None], model.stiffness, 0.0)
    out = np.zeros((len(model.A), len(model.A)), complex)
    out[n : 2 * n, :n] = -1j * loss_factor * np.linalg.solve(model.mass, K)
    return out
