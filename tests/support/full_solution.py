"""The full nonlinear finite elements solved for tests: Newton statics, arc length through limit points, free motion.

Also the same for reduced bodies, whose force and tangent are dense.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

Force = Callable[[np.ndarray], np.ndarray]
Tangent = Callable[[np.ndarray], object]


class FullModel:
    """Force and tangent of a Structure on the dofs that are not held."""

    def __init__(self, structure, held):
        self.structure, self.elastic = structure, structure.internal_force
        self.free = np.setdiff1d(np.arange(structure.n_dof), held)

    def on_all_dofs(self, x):
        out = np.zeros(self.structure.n_dof)
        out[self.free] = x
        return out

    def energy(self, x):
        return self.elastic.energy(self.on_all_dofs(x))

    def force(self, x):
        return self.elastic.force(self.on_all_dofs(x))[self.free]

    def tangent(self, x):
        return self.elastic.tangent(self.on_all_dofs(x))[self.free][:, self.free]


class Reduced:
    """Force and tangent of strain tensors."""

    def __init__(self, tensors):
        self.energy, self.force, self.tangent = tensors.energy, tensors.force, tensors.tangent


def solve(K, b):
    """K^-1 b, dense or sparse."""
    return splu(sparse.csc_array(K)).solve(b) if sparse.issparse(K) else np.linalg.solve(K, b)


def static_path(model: FullModel | Reduced, load: np.ndarray, factors: Sequence[float], x0: np.ndarray | None = None):
    """Equilibria (len(factors), n) under factors of a load, each by Newton steps from the one before."""
    x = np.zeros_like(load) if x0 is None else x0.copy()
    found = []
    for factor in factors:
        scale = np.abs(factor * load).max() + 1e-300
        for _ in range(60):
            rest = factor * load - model.force(x)
            step = solve(model.tangent(x), rest)
            x = x + step
            if np.abs(step).max() <= 1e-11 * np.abs(x).max() or np.abs(rest).max() < 1e-12 * scale:
                break
        else:
            raise RuntimeError(f"Newton steps did not converge at load factor {factor}")
        found.append(x.copy())
    return np.array(found)


def arc_length(
    model: FullModel | Reduced,
    load: np.ndarray,
    step: float,
    count: int,
    weight: np.ndarray | None = None,
    stop: Callable[[float, np.ndarray], bool] = lambda factor, x: False,
):
    """Load factors (k,) and equilibria (k, n) along a path through limit points, from rest until stop(factor, x).

    Riks' method: at most count steps of equal length sqrt(sum weight x^2), Newton corrections normal to the path.
    """
    w = np.ones_like(load) if weight is None else weight
    x, factor = np.zeros_like(load), 0.0
    path, direction = [], None
    for _ in range(count):
        v = solve(model.tangent(x), load)
        length = np.sqrt(w @ v**2)
        sign = 1.0 if direction is None or w @ (direction * v) > 0 else -1.0
        direction = sign * v / length
        x_new, factor_new = x + step * direction, factor + sign * step / length
        for _ in range(30):
            rest = factor_new * load - model.force(x_new)
            K = model.tangent(x_new)
            a, b = solve(K, np.column_stack([rest, load])).T
            change = -(w @ (direction * (x_new - x + a)) - step) / (w @ (direction * b))
            move = a + change * b
            x_new, factor_new = x_new + move, factor_new + change
            if np.sqrt(w @ move**2) < 1e-8 * step:
                break
        else:
            raise RuntimeError(f"arc length did not converge at load factor {factor}")
        direction = x_new - x  # of the last step, to keep going the same way
        x, factor = x_new, factor_new
        path.append((factor, x.copy()))
        if stop(factor, x):
            break
    return np.array([f for f, _ in path]), np.array([x for _, x in path])


def free_motion(model: FullModel | Reduced, M, x, v, dt: float, count: int):
    """Displacements (count + 1, n) of M a + f(x) = 0 by the implicit midpoint-energy (average) rule of Newmark."""
    out = [x.copy()]
    a = solve(M, -model.force(x))
    for _ in range(count):
        new = x + dt * v + dt**2 / 2 * a
        for _ in range(30):
            a_new = (new - x - dt * v) * 4 / dt**2 - a
            rest = M @ a_new + model.force(new)
            move = -solve(M * (4 / dt**2) + model.tangent(new), rest)
            new = new + move
            if np.abs(move).max() < 1e-12 * np.abs(new).max():
                break
        a_new = (new - x - dt * v) * 4 / dt**2 - a
        v = v + dt / 2 * (a + a_new)
        x, a = new, a_new
        out.append(x.copy())
    return np.array(out)


def load_factors_at(model: Reduced, load: np.ndarray, row: np.ndarray, values: Sequence[float]) -> np.ndarray:
    """Load factors (k,) at which row . x takes these values, one after the other, from rest."""
    x, factor, found = np.zeros_like(load), 0.0, []
    for value in values:
        for _ in range(50):
            rest = np.append(factor * load - model.force(x), value - row @ x)
            K = np.block([[model.tangent(x), -load[:, None]], [row[None], np.zeros((1, 1))]])
            step = np.linalg.solve(K, rest)
            x, factor = x + step[:-1], factor + step[-1]
            if np.abs(step[:-1]).max() < 1e-10 * np.abs(x).max():
                break
        else:
            raise RuntimeError(f"no equilibrium found at {value}")
        found.append(factor)
    return np.array(found)


def stepped_motion(model: FullModel | Reduced, M, D, load, dt: float, count: int):
    """Displacements (count + 1, n) of M a + D v + f(x) = load, put on at once from rest, by Newmark's average rule."""
    x, v = np.zeros_like(load), np.zeros_like(load)
    a, out = solve(M, load - model.force(x)), [x]
    for _ in range(count):
        new = x + dt * v + dt**2 / 2 * a
        for _ in range(30):
            more = (new - x - dt * v) * 4 / dt**2 - a
            rate = v + dt / 2 * (a + more)
            move = solve(
                M * (4 / dt**2) + D * (2 / dt) + model.tangent(new), load - M @ more - D @ rate - model.force(new)
            )
            new = new + move
            if np.abs(move).max() < 1e-9 * np.abs(new).max():
                break
        else:
            raise RuntimeError("Newton steps did not converge within a time step; take shorter ones")
        more = (new - x - dt * v) * 4 / dt**2 - a
        x, v, a = new, v + dt / 2 * (a + more), more
        out.append(x)
    return np.array(out)
