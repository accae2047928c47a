"""Radiation of waves by a moving body as a state space that is stable and passive by its form.

Cummins' kernel K = B + i omega (A - A_inf) over the motions that radiate together is a chain of blocks

    K(s) = G^T (s + R_1 + J_1 (s + J_2 (s + R_3 + ...)^-1 J_2^T)^-1 J_1^T)^-1 G,    R_1, R_3, ... >= 0

which is symmetric, stable and positive real for any J and G, zero at s = 0, and falls as 1/s, as the kernel does; its
damping may fall much faster. J, R and G follow from least squares over the data.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import least_squares

from femflex.arrays import Array, ComplexArray
from femflex.hydrodynamics.data import WaveData

ACCURACY = 0.02  # of the largest kernel: error that is accepted
LONGEST = 12  # blocks of a chain
EVALUATIONS = 40, 160  # of a fit, the latter where the former have not come near
COUPLED = 1e-4  # of the geometric mean: damping between two motions that counts as none
WEAK = 1e-6  # of the largest, each measured by the body's size: damping of a motion that does not radiate


@dataclass(frozen=True, eq=False)
class Radiation:
    """States z of radiation: dz/dt = rate z + input nu, and the force is -input^T z; nu the rates (m,) of the motions.

    rate      (n, n), whose symmetric part is negative: z loses energy |z|^2 / 2
    input     (n, m)
    infinite  (m, m) added mass at infinite frequency
    error     largest error of the kernel over the data, over its largest value
    """

    rate: Array
    input: Array
    infinite: Array
    error: float

    def kernel(self, omega: Array) -> ComplexArray:
        """K (n, m, m) at frequencies (n,) [rad/s]: forces per velocity [N s/m], and likewise of turns, in SI."""
        resolvent = 1j * omega[:, None, None] * np.eye(len(self.rate)) - self.rate
        return np.asarray(
            self.input.T @ np.linalg.solve(resolvent, np.broadcast_to(self.input, (len(omega), *self.input.shape)))
        )

    def over_motions(self, J: Array) -> Radiation:
        """The same over other motions (k,), of which each moves those of the data by a column of J (m, k)."""
        return replace(self, input=self.input @ J, infinite=J.T @ self.infinite @ J)


def fitted(data: WaveData) -> Radiation:
    """The Radiation of the data: the shortest chains that meet it within 2 %, or the best of the longest."""
    omega, B = data.omega, data.damping
    size = np.sqrt(np.maximum(np.einsum("nii->ni", B), 0.0).max(axis=0))  # of each motion
    moves = size**2 > WEAK * _scales(data)
    m = len(size)
    rates, inputs = [np.zeros((0, 0))], [np.zeros((0, m))]
    for group in _groups(B, size, moves):
        scale = np.outer(size[group], size[group])
        A = data.added_mass[:, group][:, :, group] / scale
        infinite = None if data.infinite is None else data.infinite[group][:, group] / scale
        chain = _fit_group(omega, B[:, group][:, :, group] / scale, A, infinite)
        own, wide = chain[0], np.zeros((len(chain[0]), m))
        wide[:, group] = chain[1] * size[group]
        rates, inputs = [*rates, own], [*inputs, wide]
    found = Radiation(block_diag(*rates[1:]) if rates[1:] else rates[0], np.concatenate(inputs), np.zeros((m, m)), 0.0)
    kernel, infinite = found.kernel(omega), data.infinite
    if infinite is None:
        infinite = np.mean(data.added_mass - kernel.imag / omega[:, None, None], axis=0)
    truth = B + 1j * omega[:, None, None] * (data.added_mass - infinite)
    scale = np.where(moves, size, np.inf)
    error = np.abs((kernel - truth) / np.outer(scale, scale)).max(initial=0.0)
    return Radiation(found.rate, found.input, infinite, float(error))


def _scales(data: WaveData) -> Array:
    """Damping (m,) against which that of a motion is nothing: of the largest, by the added masses of the motions.

    Those of rotations are one, so that one about which little water moves does not count by itself.
    """
    inertia = np.abs(np.einsum("nii->ni", data.added_mass)).max(axis=0)
    weights = np.concatenate([np.full(3, inertia[:3].max()), np.full(3, inertia[3:6].max()), inertia[6:]])
    weights = np.maximum(weights, np.finfo(float).tiny)
    B = np.einsum("nii->ni", data.damping).max(axis=0)
    return np.asarray((B / weights).max() * weights)


def _groups(B: Array, size: Array, moves: Array) -> list[list[int]]:
    """Motions that radiate together."""
    coupled = np.abs(B).max(axis=0) > COUPLED * np.outer(size, size)
    groups: list[list[int]] = []
    for k in np.flatnonzero(moves):
        joined = [group for group in groups if any(coupled[k, j] for j in group)]
        groups = [group for group in groups if group not in joined]
        groups.append(sorted([int(k), *(j for group in joined for j in group)]))
    return groups


def _fit_group(omega: Array, B: Array, A: Array, infinite: Array | None) -> tuple[Array, Array]:
    """Rate (n, n) and input (n, m) of the chain for damping B (f, m, m), at most 1 on its diagonal, and added mass."""
    m, s = B.shape[1], 1j * omega[:, None, None]
    peak = float(omega[int(np.argmax(np.einsum("fii->f", B)))])
    upper = np.triu_indices(m)

    def gap(x: Array, count: int) -> Array:
        G, J, R = _chain(x, count, m)
        inner = np.zeros((len(omega), m, m), complex)
        for k in reversed(range(count)):
            if k + 1 < count:
                inner = J[k] @ np.linalg.inv(inner) @ J[k].T
            inner = inner + s * np.eye(m) + (R[k // 2] if k % 2 == 0 else 0.0)
        kernel = G.T @ np.linalg.inv(inner) @ G
        mass = A - kernel.imag / omega[:, None, None]  # that at infinite frequency, by each of the data
        change = omega[:, None, None] * (mass - (mass.mean(axis=0) if infinite is None else infinite))
        return np.concatenate([(kernel.real - B)[:, *upper].ravel(), change[:, *upper].ravel()])

    def slope(x: Array, count: int) -> Array:
        D = _kernel_slopes(x, count, omega)[:, *upper]
        change = -D.imag
        if infinite is None:
            change = change + omega[:, None, None] * np.mean(D.imag / omega[:, None, None], axis=0)
        return np.concatenate([part.reshape(-1, x.size) for part in (D.real, change)])

    x, best = _first_chain(m, peak), None
    for count in range(2, LONGEST + 1, 2):
        # of one motion, differences cost little and are seen to end in better fits; of many they would take minutes
        jacobian = partial(slope, count=count) if m > 1 else "2-point"
        for evaluations in EVALUATIONS if m > 1 else (sum(EVALUATIONS),):
            found = least_squares(partial(gap, count=count), x, jacobian, x_scale="jac", max_nfev=evaluations)
            x, error = found.x, float(np.abs(found.fun).max())
            if error < ACCURACY / 4:
                break
        if best is None or error < best[0]:
            best = error, found.x, count
        if error < ACCURACY:
            break
        x = _longer(found.x, count, m, peak)
    assert best is not None
    return _state_space(*_chain(best[1], best[2], m))


def _kernel_slopes(x: Array, count: int, omega: Array) -> ComplexArray:
    """Derivatives (f, m, m, p) of the kernel of a chain at frequencies (f,) by its numbers x (p,).

    Those of G^T (s - F)^-1 G by the rate F are G^T (s - F)^-1 dF (s - F)^-1 G.
    """
    m = int(np.sqrt(x.size // (count + count // 2)))
    chain = _chain(x, count, m)
    rate, G = _state_space(*chain)
    resolvent = np.linalg.inv(1j * omega[:, None, None] * np.eye(len(rate)) - rate)
    left = (G.T @ resolvent).reshape(len(omega), m, count, m).transpose(2, 0, 1, 3)  # of each block: (f, m, m)
    right = (resolvent @ G).reshape(len(omega), count, m, m).transpose(1, 0, 2, 3)
    unit = np.broadcast_to(np.eye(m), left[0].shape)

    def derivatives(rows: Array | ComplexArray, columns: Array | ComplexArray, turned: bool = False) -> ComplexArray:
        order = "fib,faj->fijab" if turned else "fia,fbj->fijab"
        return np.asarray(np.einsum(order, rows, columns).reshape(len(omega), m, m, m * m), complex)

    parts = [derivatives(unit, right[0], True) + derivatives(left[0], unit)]
    parts += [derivatives(left[k + 1], right[k], True) - derivatives(left[k], right[k + 1]) for k in range(count - 1)]
    for k, L in enumerate(x.reshape(-1, m, m)[count:]):
        parts.append(-derivatives(left[2 * k], L.T @ right[2 * k]) - derivatives(left[2 * k] @ L, right[2 * k], True))
    return np.concatenate(parts, axis=-1)


def _first_chain(m: int, peak: float) -> Array:
    """Numbers of a chain of two blocks, which resonate at the peak."""
    unit = np.eye(m).ravel()
    return np.concatenate([np.sqrt(peak) * unit, peak * unit, np.sqrt(peak) * unit])


def _longer(x: Array, count: int, m: int, peak: float) -> Array:
    """Numbers of a chain with two blocks more, to which it is hardly tied."""
    blocks, more = x.reshape(-1, m * m), peak * np.eye(m).ravel()
    return np.concatenate([*blocks[:count], 0.2 * more, more, *blocks[count:], more / np.sqrt(peak)])


def _chain(x: Array, count: int, m: int) -> tuple[Array, Array, Array]:
    """G (m, m), J (count - 1, m, m) and R (count / 2, m, m) of a chain."""
    blocks = x.reshape(-1, m, m)
    L = blocks[count:]
    return blocks[0], blocks[1:count], L @ L.swapaxes(1, 2)


def _state_space(G: Array, J: Array, R: Array) -> tuple[Array, Array]:
    """Rate (n, n) and input (n, m) of a chain."""
    m, count = len(G), len(J) + 1
    rate = np.zeros((count * m, count * m))
    for k in range(count):
        here, next_one = slice(k * m, (k + 1) * m), slice((k + 1) * m, (k + 2) * m)
        if k % 2 == 0:
            rate[here, here] = -R[k // 2]
        if k + 1 < count:
            rate[here, next_one], rate[next_one, here] = -J[k], J[k].T
    return rate, np.concatenate([G, np.zeros(((count - 1) * m, m))])
