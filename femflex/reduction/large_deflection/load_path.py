"""How a structure bends while the work of one load is raised and let go: what it stays in, and snaps through.

At each held work F.x = w the energy V(x) - p.x is brought to a minimum, p a small push that decides which way a
symmetric structure buckles. Newton's step from the state before finds it where it lies near. Where it does not, or
finds a saddle, the state has lost its stability and snaps to another; it is then let go against a drag d, in steps

    x' = argmin V(x) - p.x + d/2 (x - x0).K (x - x0),      F.x = w,

each no longer than asked, the drag as small as allows for that: the way that a structure in honey would take. So an
arch is followed that buckles sideways and snaps, where paths of equilibria wind through dozens of loads that no arch
stands under.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.fem.structure import Structure
from femflex.reduction.boundary.pivots import factors, negative_pivots
from femflex.reduction.boundary.supported import supported
from femflex.reduction.modes.modeset import ModeSet

STEPS = 12  # of the work on the way to the deflection of a linear structure
FARTHEST = 1.5  # of that work: stops what comes to rest without having moved so far
SMALLEST = 1 / 32  # of a step of the work: a walk that cannot go on with it ends there
SETTLED = 1e-6  # last Newton step over the displacement
ITERATIONS = 10
LONGEST, KEPT = 2.0, 0.2  # dragged steps over those of the work in a linear structure, by energy norm: at most; noted
DRAG, STIFFEST, RATE = 0.02, 1e4, 4.0  # the least drag, the largest, and how much stiffer where a step is too long
DRAGGED = 60  # steps on the way to one minimum


@dataclass(frozen=True, eq=False)
class LoadedStructure:
    """A clamped structure with the work of a load held, pushed besides; vectors over its free dofs."""

    structure: Structure
    free: IntArray
    K: sparse.csr_array
    load: Array
    push: Array

    @property
    def constant(self) -> Array:
        """The push (n,) [N, N m], and what initial stress leaves unbalanced."""
        return self.push + self.structure.f0[self.free]

    def whole(self, x: Array) -> Array:
        """x (n_dof,) [m, rad] on all dofs."""
        out = np.zeros(self.structure.n_dof)
        out[self.free] = x
        return out

    def energy(self, x: Array) -> float:
        """Energy stored [J], over that at rest; x (n,)."""
        at = self.whole(x)
        return self.structure.internal_force.energy(at) - float(self.structure.f0 @ at)

    def equilibrium(self, x0: Array, guess: Array, work: float, drag: float) -> tuple[Array, bool] | None:
        """The state (n,) [m, rad] near a guess at that work, dragged from x0, whether it is a saddle; None where none
        is found."""
        elastic, x = self.structure.internal_force, guess.copy()
        for _ in range(ITERATIONS):
            at = self.whole(x)
            solver = factors(elastic.tangent(at)[self.free][:, self.free] + drag * self.K)
            rest = self.constant - elastic.force(at)[self.free] - drag * (self.K @ (x - x0))
            own, answer = solver.solve(np.column_stack([rest, self.load])).T
            move = own + (work - self.load @ (x + own)) / (self.load @ answer) * answer
            if not np.isfinite(move).all():
                return None
            x = x + move
            if np.abs(move).max() <= SETTLED * np.abs(x).max():
                free_to_fall = negative_pivots(solver) - (1 if self.load @ answer < 0.0 else 0)
                return x, free_to_fall > 0
        return None

    def descent(self, x: Array, guess: Array, work: float, step: float) -> tuple[list[Array], bool] | None:
        """States (n,) [m, rad] from x to one at rest at that work, which is the last, and whether it is a saddle;
        None where none is.

        What is pushed comes to rest in minima alone.
        """
        out: list[Array] = []
        drag, pushed = 0.0, bool(self.push.any())
        for _ in range(DRAGGED):
            found = self.equilibrium(x, guess, work, drag)
            length = np.inf if found is None else float(np.sqrt((found[0] - x) @ (self.K @ (found[0] - x))))
            if found is None or length > LONGEST * step or (pushed and found[1]):
                drag, guess = max(RATE * drag, DRAG), x
                if drag > STIFFEST:
                    return None
                continue
            x = guess = found[0]
            if drag == 0.0:
                return [*out, x], found[1]
            if length > KEPT * step:
                out.append(x)
            drag = drag / RATE if drag > DRAG else 0.0
        return None


def trace_load_path(
    structure: Structure, modes: ModeSet, load: Array, push: Array, deflection: float, energy: float = np.inf
) -> LoadPath:
    """The walk of a structure as the work of a load (n_dof,) is raised until some node has moved by a deflection [m].

    Or until it stores an energy [J]. Where it snaps on the way, the work is taken back again. push (n_dof,): the small
    load; without one, states are taken that are saddles.
    """
    on = supported(structure, modes.held)
    free, K = on.free, on.K
    held = LoadedStructure(structure, free, K, load[free], push[free])
    u = on.factors.solve(held.load)
    u *= deflection / largest_displacement(structure, held.whole(u))
    most = float(held.load @ u)
    step, path = float(np.sqrt(u @ (K @ u))) / STEPS, LoadPath(held, u / most, most / STEPS)
    while largest_displacement(structure, held.whole(path.x)) < deflection and path.work < FARTHEST * most:
        if not path.advance(1.0, step):
            break
        if path.stored() > energy:
            return path
    if path.snapped:
        while path.work > 0.0 and path.advance(-1.0, step):
            pass
    return path


class LoadPath:
    """How far a walk has come, its states, whether it has snapped on the way, and whether it came upon a saddle."""

    def __init__(self, held: LoadedStructure, way: Array, part: float) -> None:
        self.held, self.way, self.part, self.whole_part = held, way, part, part
        self.x, self.work = np.zeros_like(way), 0.0
        self.states: list[Array] = []
        self.snapped = self.saddle = False

    def stored(self) -> float:
        """Energy of the last state [J]."""
        return self.held.energy(self.x)

    def advance(self, sense: float, step: float) -> bool:
        """Go on by a part of the work, less where nothing is found with it; False where nothing is."""
        while self.part >= SMALLEST * self.whole_part:
            change = sense * self.part
            found = self.held.descent(self.x, self.x + change * self.way, self.work + change, step)
            if found is None:
                self.part /= 2
                continue
            states, saddle = found
            self.snapped, self.saddle = self.snapped or len(states) > 1, self.saddle or saddle
            self.states += [self.held.whole(x) for x in states]
            self.way = (states[-1] - self.x) / change if len(states) == 1 else 0.0 * self.way
            self.x, self.work = states[-1], self.work + change
            return True
        return False


def largest_displacement(structure: Structure, x: Array) -> float:
    """The largest displacement of a node [m]; x (n_dof,)."""
    return float(np.linalg.norm((structure.translation @ x).reshape(-1, 3), axis=1).max())
