"""Response shapes: static states of a structure under loads up to large deflections, combined into shapes.

The work of one load, a unit acceleration of the clamps or a unit force at a group, is raised in both directions and
lowered again if the structure snaps (`load_path`). The combinations of states that store most energy (proper orthogonal
decomposition by energy) represent this motion with far fewer shapes than modes and their derivatives; they do not
represent other motions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.fem.structure import Structure
from femflex.reduction.boundary.supported import factors, negative_pivots, supported
from femflex.reduction.modes.vibration import ModeSet, load_vectors, responses_to_clamp_accelerations, ritz

PUSH = 1e-3  # energy norm of a mode's response to the small load, over that of the linear response to the load
PUSHED = 3  # number of the lowest modes that the small load excites
RANK = 1e-12  # of the energy of one state, below which a combination adds nothing
LEFT_OUT = 1e-5  # mean share of the energy of states without the small load that shapes may omit


def with_responses(
    structure: Structure,
    modes: ModeSet,
    count: int,
    deflection: float,
    directions: Sequence[str] = (),
    loads: Mapping[str, Sequence[str]] | None = None,
) -> ModeSet:
    """The set with `count` shapes added, M-orthonormal, of static responses to loads up to a deflection [m].

    directions: of x, y, z, in which the clamps are accelerated; loads: group -> directions of unit forces and moments
    there. The default is the acceleration that moves the structure most. Each load acts in both directions until some
    node has moved by `deflection`; in the stiffer direction only up to the same energy. If unstable states occur, a
    small additional load on the lowest modes is applied in both directions, because a symmetric structure buckles to
    both sides. If the load alone led to saddles, the states with the small load have buckled, and the remaining shapes
    are computed from them; otherwise they are equivalent to those of the load alone. The kind of the shapes is
    "response"; omega is that of the structure confined to them, and `note` states the number of states and their
    largest deflection. Raises ValueError without clamps, and if no state is found.
    """
    if not modes.held.size:
        raise ValueError("responses are static states of a clamped structure, and this set is of a free one; drop them")
    states_of_loads = [
        _states_in_both_directions(structure, modes, F, deflection)
        for F in _requested_loads(structure, modes, directions, loads or {})
    ]
    plain, buckled = (np.concatenate(part) for part in zip(*states_of_loads, strict=True))
    if not len(plain):
        raise ValueError(f"no static state was found on the way to a deflection of {deflection:.3g} m; lower it")
    n, phi = modes.n_modes, modes.phi
    for states, left_out in ((plain, LEFT_OUT), (buckled, 0.0), (plain, 0.0)):
        phi = np.column_stack([phi, _shapes_of_most_energy(structure, phi, states, n + count - phi.shape[1], left_out)])
    omega, shapes = ritz(structure, phi[:, n:])
    n_added, states = len(omega), np.concatenate([plain, buckled])
    reach = max(largest_displacement(structure, state) for state in states)
    note = f"{n_added} response shapes of {len(states)} states bent by up to {reach:.3g} m"
    return modes.with_shapes(shapes, ("response",) * n_added, omega, note)


def _requested_loads(
    structure: Structure, modes: ModeSet, directions: Sequence[str], loads: Mapping[str, Sequence[str]]
) -> Array:
    """The loads (k, n_dof), by default the acceleration of the clamps that moves the structure most."""
    if directions or loads:
        return load_vectors(structure, directions, loads).T
    accelerations, responses = responses_to_clamp_accelerations(structure, modes)
    return accelerations[:, [int(np.argmax([largest_displacement(structure, u) for u in responses.T]))]].T


def _shapes_of_most_energy(structure: Structure, known: Array, states: Array, count: int, left_out: float) -> Array:
    """Combinations (n_dof, k <= count) of states (n, n_dof) outside known shapes, M-orthonormal with each other.

    They are ordered by energy, relative to that of each state; as many as omit at most `left_out` of it in the mean.
    """
    if not len(states) or count <= 0:
        return known[:, :0]
    elastic = structure.internal_force
    stored = np.array([elastic.energy(x) - float(structure.f0 @ x) for x in states])
    y = _outside_shapes(structure, known, states.T) / np.sqrt(stored)
    energy, X = np.linalg.eigh(y.T @ (structure.K @ y))
    energy, X = np.maximum(energy[::-1], 0.0), X[:, ::-1]
    omitted = (energy.sum() - np.cumsum(energy)) / len(stored)
    count_kept = min(count, int(np.sum(energy > RANK)), int(np.sum(omitted > left_out)) + 1)
    return ritz(structure, _outside_shapes(structure, known, y @ (X[:, :count_kept] / np.sqrt(energy[:count_kept]))))[1]


def _outside_shapes(structure: Structure, known: Array, shapes: Array) -> Array:
    """The shapes, made M-orthogonal to known M-orthonormal ones."""
    return np.asarray(shapes - known @ (known.T @ (structure.M @ shapes)))


def _states_in_both_directions(
    structure: Structure, modes: ModeSet, load: Array, deflection: float
) -> tuple[Array, Array]:
    """States (k, n_dof) under a load in both directions, first the softer one: without and with buckling."""
    elastic = structure.internal_force
    u = supported(structure, modes.held).answers(load)
    u *= deflection / largest_displacement(structure, u)
    softer = -1.0 if float(elastic.second_derivative(u[:, None])[:, 0] @ u) > 0.0 else 1.0
    push, energy_limit = _push(structure, modes, u), np.inf
    plain, buckled = list[Array](), list[Array]()
    for sense in (softer, -softer):
        path = trace_load_path(structure, modes, sense * load, 0.0 * push, deflection, energy_limit)
        plain += path.states
        if path.saddle or path.snapped:
            for side in (push, -push):
                states = trace_load_path(structure, modes, sense * load, side, deflection, energy_limit).states
                (buckled if path.saddle else plain).extend(states)
        energy_limit = max((elastic.energy(x) - float(structure.f0 @ x) for x in path.states), default=np.inf)
    return np.array(plain).reshape(-1, structure.n_dof), np.array(buckled).reshape(-1, structure.n_dof)


def _push(structure: Structure, modes: ModeSet, u: Array) -> Array:
    """The small load (n_dof,) on the lowest vibration modes, for a load with the linear response u."""
    lowest = [k for k, kind in enumerate(modes.kinds) if kind == "vibration"][:PUSHED]
    phi = modes.phi[:, lowest]
    phi = phi / np.sqrt(np.einsum("in,in->n", phi, structure.K @ phi))
    return np.asarray(PUSH * np.sqrt(u @ (structure.K @ u)) * (structure.K @ phi).sum(axis=1))


# Static states of a structure while the work of one load is raised and lowered, with snap-through.
#
# At each prescribed work F.x = w the energy V(x) - p.x is minimised; the small load p selects the direction in which a
# symmetric structure buckles. Newton steps from the previous state find a minimum that is close. If they fail, or find
# a saddle, the state has lost its stability and snaps to another one; this motion is computed with a drag d, in steps
#
#     x' = argmin V(x) - p.x + d/2 (x - x0).K (x - x0),      F.x = w,
#
# with the smallest drag that limits the length of a step: the motion of a structure in a very viscous fluid. This
# follows an arch that buckles sideways and snaps, where a path of equilibria passes through dozens of unstable loads.


STEPS = 12  # steps of the work up to the deflection of a linear structure
FARTHEST = 1.5  # of that work: limit for structures that do not reach the deflection
SMALLEST = 1 / 32  # of a step of the work: smallest part before the path ends
SETTLED = 1e-6  # last Newton step over the displacement
ITERATIONS = 10
LONGEST, KEPT = 2.0, 0.2  # dragged steps over work steps of a linear structure, by energy norm: longest; kept above
DRAG, STIFFEST, RATE = 0.02, 1e4, 4.0  # smallest and largest drag, and its factor where a step is too long
DRAGGED = 60  # largest number of steps to one minimum


@dataclass(frozen=True, eq=False)
class LoadedStructure:
    """A clamped structure with prescribed work of a load, and a small additional load; vectors over the free dofs."""

    structure: Structure
    free: IntArray
    K: sparse.csr_array
    load: Array
    push: Array

    @property
    def constant(self) -> Array:
        """The constant forces (n,) [N, N m]: the small load, and the unbalanced part of initial stress."""
        return self.push + self.structure.f0[self.free]

    def on_all_dofs(self, x: Array) -> Array:
        """The displacements x (n,) on all dofs (n_dof,) [m, rad]."""
        out = np.zeros(self.structure.n_dof)
        out[self.free] = x
        return out

    def energy(self, x: Array) -> float:
        """Strain energy [J] of displacements x (n,), relative to rest."""
        displacements = self.on_all_dofs(x)
        return self.structure.internal_force.energy(displacements) - float(self.structure.f0 @ displacements)

    def equilibrium(self, x0: Array, guess: Array, work: float, drag: float) -> tuple[Array, bool] | None:
        """The state (n,) [m, rad] with that work, with a drag from x0, and whether it is a saddle.

        None if Newton steps from the guess do not converge.
        """
        elastic, x = self.structure.internal_force, guess.copy()
        for _ in range(ITERATIONS):
            displacements = self.on_all_dofs(x)
            solver = factors(elastic.tangent(displacements)[self.free][:, self.free] + drag * self.K)
            residual = self.constant - elastic.force(displacements)[self.free] - drag * (self.K @ (x - x0))
            unloaded, per_load = solver.solve(np.column_stack([residual, self.load])).T
            step = unloaded + (work - self.load @ (x + unloaded)) / (self.load @ per_load) * per_load
            if not np.isfinite(step).all():
                return None
            x = x + step
            if np.abs(step).max() <= SETTLED * np.abs(x).max():
                free_to_fall = negative_pivots(solver) - (1 if self.load @ per_load < 0.0 else 0)
                return x, free_to_fall > 0
        return None

    def descent(self, x: Array, guess: Array, work: float, step: float) -> tuple[list[Array], bool] | None:
        """States (n,) [m, rad] from x to an equilibrium with that work, the last one, and whether it is a saddle.

        None if there is none. With a small additional load only minima are equilibria.
        """
        states: list[Array] = []
        drag, is_pushed = 0.0, bool(self.push.any())
        for _ in range(DRAGGED):
            result = self.equilibrium(x, guess, work, drag)
            length = np.inf if result is None else float(np.sqrt((result[0] - x) @ (self.K @ (result[0] - x))))
            if result is None or length > LONGEST * step or (is_pushed and result[1]):
                drag, guess = max(RATE * drag, DRAG), x
                if drag > STIFFEST:
                    return None
                continue
            x = guess = result[0]
            if drag == 0.0:
                return [*states, x], result[1]
            if length > KEPT * step:
                states.append(x)
            drag = drag / RATE if drag > DRAG else 0.0
        return None


def trace_load_path(
    structure: Structure, modes: ModeSet, load: Array, push: Array, deflection: float, energy: float = np.inf
) -> LoadPath:
    """The LoadPath of a structure as the work of a load (n_dof,) is raised until a node has moved by a deflection [m].

    It also ends when the structure stores an energy [J]. If the structure snaps, the work is lowered again.
    push (n_dof,): the small load; without it, saddles are accepted.
    """
    supports = supported(structure, modes.held)
    free, K = supports.free, supports.K
    loaded = LoadedStructure(structure, free, K, load[free], push[free])
    u = supports.factors.solve(loaded.load)
    u *= deflection / largest_displacement(structure, loaded.on_all_dofs(u))
    linear_work = float(loaded.load @ u)
    step, path = float(np.sqrt(u @ (K @ u))) / STEPS, LoadPath(loaded, u / linear_work, linear_work / STEPS)
    while (
        largest_displacement(structure, loaded.on_all_dofs(path.x)) < deflection and path.work < FARTHEST * linear_work
    ):
        if not path.advance(1.0, step):
            break
        if path.stored() > energy:
            return path
    if path.snapped:
        while path.work > 0.0 and path.advance(-1.0, step):
            pass
    return path


class LoadPath:
    """The states of a path of increasing work, and whether the structure has snapped or reached a saddle."""

    def __init__(self, held: LoadedStructure, way: Array, part: float) -> None:
        self.held, self.way, self.part, self.whole_part = held, way, part, part
        self.x, self.work = np.zeros_like(way), 0.0
        self.states: list[Array] = []
        self.snapped = self.saddle = False

    def stored(self) -> float:
        """Energy of the last state [J]."""
        return self.held.energy(self.x)

    def advance(self, sense: float, step: float) -> bool:
        """Continue by a part of the work, or a smaller one if no state is found; False if none is found at all."""
        while self.part >= SMALLEST * self.whole_part:
            change = sense * self.part
            result = self.held.descent(self.x, self.x + change * self.way, self.work + change, step)
            if result is None:
                self.part /= 2
                continue
            states, saddle = result
            self.snapped, self.saddle = self.snapped or len(states) > 1, self.saddle or saddle
            self.states += [self.held.on_all_dofs(x) for x in states]
            self.way = (states[-1] - self.x) / change if len(states) == 1 else 0.0 * self.way
            self.x, self.work = states[-1], self.work + change
            return True
        return False


def largest_displacement(structure: Structure, x: Array) -> float:
    """The largest displacement of a node [m]; x (n_dof,)."""
    return float(np.linalg.norm((structure.translation @ x).reshape(-1, 3), axis=1).max())
