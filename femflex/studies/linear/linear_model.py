"""Linear model of a system, by differentiation of its compiled equations and of its channels.

    M du' + (D + G) du + K dxi + R dz = Q du_in,    dxi' = du + W dxi,    dz' = F_x dxi + F_u du + F_z dz + F_in du_in

The equations of the coordinates are those of `femflex.linear.equations`. Columns of inputs come from the
same system with a small increment of the input; outputs are differences of channels. The value and rate of a prescribed
coordinate are states of the model, and its acceleration is the input.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

from femflex.arrays import Array
from femflex.dynamics.model import Model, compile_system
from femflex.dynamics.motion.freedoms import usual_sizes
from femflex.dynamics.motion.increments import STEPS, displaced, local_derivative, on_line
from femflex.effectors.constant_commands import FOLLOWER, UNIT, with_followers_of, with_held_commands
from femflex.linear.equations import Linearised, linearised
from femflex.linear.equilibrium import Equilibrium, rest_equilibrium, rest_system
from femflex.linear.states import effector_states
from femflex.linear.system_modes import SystemModes, modes_about
from femflex.noun.problems import suggestion_text
from femflex.studies.linear.inputs import Input, default_inputs, inputs_of
from femflex.studies.linear.space import StateSpace
from femflex.summary import Rows, Summarised, listed
from femflex.system import Effector, System

STEP = 1e-5  # of a coordinate's usual size, as in `linearised`: error of central differences 1e-10
ROUNDING = 16 * np.finfo(float).eps  # of a channel's size: a smaller difference of two values counts as zero


@dataclass(frozen=True, eq=False, repr=False)
class LinearModel(Summarised, StateSpace):
    """The linear model of a craft about a state; its first states are increments of coordinates, then their rates.

    mass, damping, stiffness  M, D + G and K (n, n) of the n independent coordinates
    model     the compiled system that it is about, and x (n_x,) the state, t the time [s]
    y0        (n_out,) outputs there
    about     the equilibrium; None about an instant of a motion
    left_out  loads that do not act in the equilibrium, prescribed motions that stay at their initial values
    """

    mass: Array
    damping: Array
    stiffness: Array
    model: Model
    x: Array
    t: float
    y0: Array
    about: Equilibrium | None = None
    left_out: tuple[str, ...] = ()

    def summary(self) -> tuple[str, Rows]:
        """Title, states, inputs and outputs."""
        about = "an equilibrium" if self.about is not None else f"the state at t = {self.t:g} s"
        rows = [("states", f"{len(self.A)}: {listed([name for name, _ in self.states])}")]
        rows += [("inputs", listed([f"{name} [{unit}]" for name, unit in self.inputs]))]
        rows += [("outputs", listed([f"{name} [{unit}]" for name, unit in self.outputs]))]
        return f"Linear model about {about}", rows

    def selected(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> LinearModel:
        """The model with only these inputs and outputs, in this order."""
        selection = super().selected(inputs, outputs)
        names = [name for name, _ in self.outputs]
        return replace(selection, y0=self.y0[[names.index(name) for name, _ in selection.outputs]])

    @cached_property
    def modes(self) -> SystemModes | None:
        """The natural modes about the equilibrium, of the states of effectors too; None where there is none."""
        return None if self.about is None else modes_about(self.about)


def linear_model(
    system: System,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    *,
    at: float | None = None,
    state: Array | None = None,
) -> LinearModel:
    """The linear model of a system about the equilibrium nearest to its initial coordinates, or about a state.

    inputs   paths such as "loads/slew/torque:y" (see `femflex.studies.linear.inputs`); left out, the loads of the
             case along the axes in which they act, prescribed motions, signals, and commands of controllers
    outputs  channels, as in "bodies/hub/rate" or "bodies/hub/rate:y"; left out, attitude, rates of the root body,
             deflections of markers, and what sensors measure
    at       time [s] at which loads and motions are taken; by default those that vary are omitted in the equilibrium
    state    (n_x,) about which the model holds at that time, as a row of a run; no equilibrium is sought then

    Commands of sampled controllers are held. Derivatives are central differences, accurate to 1e-8 of each block's
    largest entry. Raises KeyError for unknown inputs and outputs, and as `femflex.equilibrium`.
    """
    followed, system = with_held_commands(system, followers=False), with_held_commands(system)
    paths = default_inputs(system, _moving_coordinates(system)) if inputs is None else inputs
    inputs_of(system, paths)  # unknown ones are reported before the equilibrium is sought
    left_out: tuple[str, ...] = ()
    about, t = None, at or 0.0
    if state is None:
        about, left_out = rest_equilibrium(followed, at)
        system = with_followers_of(followed, about.model.system)
        model = compile_system(rest_system(system, at, about))
        x = about.state_in(model)
    else:
        model = compile_system(system)
        x = np.asarray(state, float)
        if x.shape != (model.n_x,):
            raise ValueError(f"the state has the shape {x.shape}; expected ({model.n_x},), as a row of a run")
    selected_inputs = inputs_of(model.system, paths)
    if any(entry.kind == "motion" for entry in selected_inputs) and model.constraints is not None:
        raise ValueError("with loops a prescribed motion cannot be an input of a linear model; take loads")
    return _Builder(model, x, t, selected_inputs, outputs).build(about, left_out)


def _moving_coordinates(system: System) -> list[str]:
    """Names of the prescribed coordinates that move."""
    moving = ((joint, k) for joint in system.joints for k, motion in joint.prescribed.items() if motion.moves)
    return [joint.freedom_names()[k] for joint, k in moving]


class _Builder:
    """The blocks of a linear model about a state x at t."""

    def __init__(
        self, model: Model, x: Array, t: float, inputs: Sequence[Input], outputs: Sequence[str] | None
    ) -> None:
        self.model, self.x, self.t, self.inputs = model, x, t, inputs
        self.output_indices, self.outputs = output_entries(model, outputs)
        self.places, self.state_sizes = effector_states(model)
        self.udot = model.state_rate(t, x)[model.n_q : model.n_q + model.n_u]
        if model.system.loops or not self.udot.any():
            self.udot = np.zeros(model.n_u)
        names = [name for name, _ in model.system.coordinate_names()]
        self.coordinates = dict(zip(names, model.parts(x)[0].tolist(), strict=True))
        self.y0 = self._outputs(model, x)

    def build(self, about: Equilibrium | None, left_out: tuple[str, ...]) -> LinearModel:
        """The linear model."""
        linear = linearised(self.model, self.t, self.x, self.udot)
        Z = linear.Z
        A, C = linear.state_matrix(), self._output_matrix(Z)
        prescribed = [entry for entry in self.inputs if entry.kind == "motion"]
        columns = [self._column(entry, linear.M, Z) for entry in self.inputs]
        B = np.column_stack([np.zeros((len(A), 0)), *(state for state, _ in columns)])
        D = np.column_stack([np.zeros((len(C), 0)), *(outputs for _, outputs in columns)])
        if prescribed:
            A, B, C = self._with_motions(prescribed, (A, B, C), linear.M, Z)
        names, units = self._state_names(linear, prescribed)
        return LinearModel(
            A, B, C, D, tuple(zip(names, units, strict=True)), tuple((entry.path, entry.unit) for entry in self.inputs),
            self.outputs, linear.M, linear.D, linear.K, self.model, self.x, self.t, self.y0, about, left_out,
            frames=self._frames(),
        )  # fmt: skip

    def _frames(self) -> dict[str, str]:
        """Axes of every input and output that has some."""
        frames = {entry.path: entry.frame for entry in self.inputs}
        for (path, _), (name, _) in zip(self.output_indices, self.outputs, strict=True):
            frames[name] = self.model.channels[path].frame
        return {name: frame for name, frame in frames.items() if frame}

    def _state_names(self, linear: Linearised, prescribed: list[Input]) -> tuple[list[str], list[str]]:
        system = self.model.system
        rates = dict(system.velocity_names())
        names = [name.removesuffix("_rate").replace(".omega_", ".turn_") for name in linear.names]
        units = [rates[name].removesuffix("/s") if rates[name].endswith("/s") else rates[name] for name in linear.names]
        states = dict(system.state_names())
        names += [*linear.names, *linear.states.names]
        units += [rates[name] for name in linear.names] + [states[name] for name in linear.states.names]
        for entry in prescribed:
            names += [entry.owner, f"{entry.owner}_rate"]
            units += [entry.unit.removesuffix("/s^2"), entry.unit.removesuffix("^2")]
        return names, units

    def _with_motions(
        self, prescribed: list[Input], blocks: tuple[Array, Array, Array], M: Array, Z: Array
    ) -> tuple[Array, Array, Array]:
        """A, B, C with value and rate of each prescribed coordinate as two further states."""
        A, B, C = blocks
        n, m = len(A), 2 * len(prescribed)
        extended = np.zeros((n + m, n + m))
        extended[:n, :n], B, C = A, np.vstack([B, np.zeros((m, B.shape[1]))]), np.hstack([C, np.zeros((len(C), m))])
        for k, entry in enumerate(prescribed):
            for order in (0, 1):
                extended[:n, n + 2 * k + order], C[:, n + 2 * k + order] = self._motion_column(entry, order, M, Z)
            extended[n + 2 * k, n + 2 * k + 1] = 1.0
            B[n + 2 * k + 1, self.inputs.index(entry)] = 1.0
        return extended, B, C

    def _column(self, entry: Input, M: Array, Z: Array) -> tuple[Array, Array]:
        """Columns of B and D of an input."""
        if entry.kind == "motion":
            return self._motion_column(entry, 2, M, Z)

        def equations(h: float) -> Array:
            return self._equations(
                compile_system(entry.with_increment(self.model.system, h, self.coordinates)), self.x, self.udot
            )

        return self._columns_of(equations, entry.step, M, Z, 1 if entry.is_affine else STEPS)

    def _motion_column(self, entry: Input, order: int, M: Array, Z: Array) -> tuple[Array, Array]:
        """Columns of value (0), rate (1) or acceleration (2) of a prescribed coordinate."""
        names = [name.removesuffix("_rate") for name, _ in self.model.system.velocity_names()]
        u = names.index(entry.owner)
        fastest = max(1.0, float(np.abs(self.model.parts(self.x)[1]).max(initial=0.0)))
        step = (STEP * float(usual_sizes(self.model)[u]), STEP * fastest, 1.0)[order]

        def equations(h: float) -> Array:
            coefficients = h * np.eye(3)[order] / (2.0 if order == 2 else 1.0)
            along = np.eye(3)[order, :, None] * np.eye(self.model.n_u)[u] * h
            x = displaced(self.model, self.x, along[0], along[1])
            system = entry.with_motion_change(self.model.system, self.t, coefficients)
            return self._equations(compile_system(system), x, self.udot + along[2])

        return self._columns_of(equations, step, M, Z)

    def _equations(self, model: Model, x: Array, udot: Array) -> Array:
        """Forces, rates of the states of effectors, and outputs, one after another."""
        rates = model.state_rate(self.t, x)[self.places]
        return np.concatenate([model.residual(self.t, x, udot), rates, self._outputs(model, x)])

    def _columns_of(
        self, f: Callable[[float], Array], step: float, M: Array, Z: Array, steps: int = STEPS
    ) -> tuple[Array, Array]:
        """Columns of the states and of the outputs, from the equations as a function of the increment."""
        derivative = self._derivative(f, step, steps)
        forces, rates, outputs = np.split(derivative, np.cumsum([self.model.n_u, len(self.places)]))
        return np.concatenate([np.zeros(len(M)), np.linalg.solve(M, -Z.T @ forces), rates]), outputs

    def _output_matrix(self, Z: Array) -> Array:
        """C over increments along Z, their rates, and the states of effectors."""
        u = self.model.parts(self.x)[1]
        sizes, fastest = usual_sizes(self.model), max(1.0, float(np.abs(u).max(initial=0.0)))
        columns = []

        def of_coordinates(xi: Array) -> Array:
            return self._outputs(self.model, displaced(self.model, self.x, xi))

        def of_rates(du: Array) -> Array:
            return self._outputs(self.model, displaced(self.model, self.x, du=du))

        def of_states(dx: Array) -> Array:
            return self._outputs(self.model, self.x + dx)

        columns += [self._derivative(on_line(of_coordinates, d), STEP / float(np.abs(d / sizes).max())) for d in Z.T]
        columns += [self._derivative(on_line(of_rates, d), STEP * fastest) for d in Z.T]
        for index, size in zip(self.places, self.state_sizes, strict=True):
            columns.append(self._derivative(on_line(of_states, np.eye(self.model.n_x)[index]), STEP * size))
        return np.column_stack([np.zeros((len(self.outputs), 0)), *columns])

    def _derivative(self, f: Callable[[float], Array], step: float, steps: int = STEPS) -> Array:
        """Derivative of a function of the increment; zero where the longest step changes it only by rounding.

        steps: at most; one for a linear function.
        """
        forward, backward = f(step), f(-step)
        is_rounding = np.abs(forward - backward) <= ROUNDING * np.maximum(np.abs(forward), np.abs(backward))
        slope = (forward - backward) / (2.0 * step) if steps == 1 else local_derivative(f, step)
        return np.where(is_rounding, 0.0, slope)

    def _outputs(self, model: Model, x: Array) -> Array:
        channels = model.observe(np.array([self.t]), x[None])
        return np.array([np.ravel(channels[path][0])[k] for path, k in self.output_indices])


def output_entries(
    model: Model, requested: Sequence[str] | None
) -> tuple[list[tuple[str, int]], tuple[tuple[str, str], ...]]:
    """(channel, index of the entry) of every output, and their names and units.

    Raises KeyError, nearest name first.
    """
    entries, outputs = [], []
    for text in default_outputs(model) if requested is None else requested:
        path, _, component = text.partition(":")
        if path not in model.channels:
            raise KeyError(f"the craft has no output {path!r}; {suggestion_text(path, model.channels)}")
        channel = model.channels[path]
        count = int(np.prod(channel.shape))
        names = channel.names if len(channel.names) == count else tuple(str(k + 1) for k in range(count))
        if component and component not in names:
            raise KeyError(f"channel {path!r} has no component {component!r}; {suggestion_text(component, names)}")
        units = channel.unit.split(", ")
        columns: Sequence[int] = range(len(names))
        if set(names) == {"x", "y", "z"}:  # of angles the channel has them in the order of their sequence
            columns = sorted(columns, key=names.__getitem__)
        for k in columns:
            name = names[k]
            if component in ("", name):
                entries.append((path, k))
                outputs.append((f"{path}:{name}" if channel.shape else path, units[k % len(units)]))
    return entries, tuple(outputs)


def default_outputs(model: Model) -> list[str]:
    """Attitude, rates of the root body, deflections of flexible bodies' markers, and channels of effectors."""
    system = model.system
    deflections = {
        f"markers/{name}.{marker}/deflection" for name, b in system.bodies.items() if b.n_modes for marker in b.markers
    }
    selected = {"attitude/angles", f"bodies/{system.root}/rate", *deflections}
    hidden = [f"effectors/{e.name}/" for e in system.effectors if isinstance(e, Effector) and e.kind == FOLLOWER]
    return [
        path
        for path in model.channels
        if path in selected
        or (path.startswith("effectors/") and UNIT not in path and not path.startswith(tuple(hidden)))
    ]


@dataclass(frozen=True, eq=False)
class SecondOrder:
    """Matrices of n coordinates, m further states and n_in inputs, in SI.

    mass, damping, gyroscopic, stiffness, turning  M, D (symmetric), G (skew), K, W (n, n)
    coupling (n, m)  R;  forces (n, n_in)  Q
    modes    (n, n)  Phi, columns by rising omega^2
    """

    mass: Array
    damping: Array
    gyroscopic: Array
    stiffness: Array
    turning: Array
    coupling: Array
    forces: Array
    modes: Array

    def over_modes(self) -> SecondOrder:
        """The same equations over the modes, so that the mass is 1."""
        Phi = self.modes
        square = {key: Phi.T @ getattr(self, key) @ Phi for key in ("damping", "gyroscopic", "stiffness")}
        return SecondOrder(
            np.eye(len(Phi)),
            **square,
            turning=Phi.T @ self.mass @ self.turning @ Phi,
            coupling=Phi.T @ self.coupling,
            forces=Phi.T @ self.forces,
            modes=np.eye(len(Phi)),
        )


def second_order(model: LinearModel) -> SecondOrder:
    """The second-order form of a linear model."""
    n, M = len(model.mass), model.mass
    DG, K = model.damping, model.stiffness
    _, modes = eigh((K + K.T) / 2, (M + M.T) / 2)
    return SecondOrder(
        M,
        (DG + DG.T) / 2,
        (DG - DG.T) / 2,
        K,
        model.A[:n, :n],
        -M @ model.A[n : 2 * n, 2 * n :],
        M @ model.B[n : 2 * n],
        np.asarray(modes),
    )
