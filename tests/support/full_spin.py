"""A structure in a frame that turns about a fixed axis through its origin, solved with all its finite elements.

Displacements N x of points of mass rho + N x are linear in the dofs, so the inertia forces of any rate Om and angular
acceleration al about the unit axis e follow from five constant tables over the points, with E = skew(e):

    M xdd + 2 Om C xd + (Om^2 S + al C) x + f(x) + Om^2 s + al c = 0
    M, C, S = int N^T (1, E, E E) N dm        c, s = int N^T (E, E E) rho dm

f and its tangent are those of the full nonlinear strain. Nothing here knows of reduced bodies or their equations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import eigs, splu

from support.full_solution import FullModel


def skew(e):
    return np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]], float)


def mass_points(structure):
    """dm (p,), rho (p, 3) and rows N (3 p, n_dof) of all points of mass."""
    dm, rho, rows, n_raw = [], [], [], structure.T.shape[0]
    for block in structure.inertia:
        for e, dofs in enumerate(block.dofs):
            unit = np.zeros((n_raw, len(dofs)))
            unit[dofs, np.arange(len(dofs))] = 1.0
            own = block.shapes(unit, slice(e, e + 1)).reshape(-1, len(dofs))
            i, j = np.nonzero(own)
            rows.append(sparse.csr_array((own[i, j], (i, dofs[j])), shape=(len(own), n_raw)))
        dm.append(block.dm.ravel())
        rho.append(block.rho.reshape(-1, 3))
    return np.concatenate(dm), np.concatenate(rho), sparse.csr_array(sparse.vstack(rows) @ structure.T)


def gyroscopic_frequencies(M, G, K, count):
    """The lowest `count` frequencies (count,) of M xdd + G xd + K x = 0, sparse matrices."""
    n = M.shape[0]
    A = sparse.block_array([[None, sparse.eye_array(n)], [-K, -G]], format="csc").astype(complex)
    B = sparse.block_diag([sparse.eye_array(n), M], format="csc").astype(complex)
    found = eigs(A, 2 * count + 2, B, sigma=0.01j, v0=np.ones(2 * n, complex), return_eigenvectors=False)
    return np.sort(found.imag[found.imag > 0])[:count]


class Parts:
    """Force and tangent as sums over the parts that a strain block's nonlinear energy is made of."""

    def __init__(self, block, T):
        self.parts = [Points(part, T) for part in block.nonlinear(slice(None))]

    def force(self, x):
        return sum(part.force(x) for part in self.parts)

    def tangent(self, x):
        return sum(part.tangent(x) for part in self.parts)


class Points:
    """Force and tangent as sums over the points of one strain block, its rows G (p g, n) stored: fast in time steps."""

    def __init__(self, block, T):
        self.block = block
        e, q, g, l = (len(block.dofs), *self.block.rows(slice(None)).shape[1:])
        rows = np.broadcast_to(self.block.rows(slice(None)), (e, q, g, l))
        at = np.broadcast_to(np.arange(e * q * g).reshape(e, q, g, 1), rows.shape)
        to = np.broadcast_to(block.dofs[:, None, None], rows.shape)
        self.G = sparse.csr_array((rows.ravel(), (at.ravel(), to.ravel())), shape=(e * q * g, T.shape[0])) @ T
        self.weight, self.shape = self.block.weight.reshape(-1, 1), (e * q, g)
        strains = block.elastic.shape[2:]
        self.C = np.broadcast_to(block.elastic, (e, q, *strains)).reshape(e * q, *strains)

    def state(self, x):
        """d eps / d g (p, s, g) and stress times area (p, s)."""
        g = (self.G @ x).reshape(self.shape)
        Qg = np.einsum("sgh,ph->psg", self.block.quadratic_map, g)
        strain = np.einsum("psg,pg->ps", self.block.linear_map + Qg / 2, g)
        return self.block.linear_map + Qg, self.weight * np.einsum("pst,pt->ps", self.C, strain)

    def force(self, x):
        D, sigma = self.state(x)
        return self.G.T @ np.einsum("psg,ps->pg", D, sigma).ravel()

    def tangent(self, x):
        D, sigma = self.state(x)
        inner = np.einsum("psg,pst,pth->pgh", D, self.weight[:, :, None] * self.C, D, optimize=True)
        inner += np.einsum("ps,sgh->pgh", sigma, self.block.quadratic_map)
        p = len(inner)
        middle = sparse.bsr_array((inner, np.arange(p), np.arange(p + 1)), shape=self.G.shape[:1] * 2)
        return self.G.T @ (middle.tocsr() @ self.G)


class Spun(FullModel):
    """A Structure of one unstressed plate member with held dofs, in a frame that turns about `axis` (3,)."""

    def __init__(self, structure, held, axis):
        super().__init__(structure, held)
        (block,) = structure.strain
        self.elastic = Parts(block, structure.T)
        dm, rho, N = mass_points(structure)
        N = N[:, self.free]
        E = skew(np.asarray(axis) / np.linalg.norm(axis))

        def moments(A):
            weighted = N.T @ sparse.kron(sparse.diags_array(dm), A, format="csr")
            return sparse.csc_array(weighted @ N), weighted @ rho.ravel()

        self.M, _ = moments(np.eye(3))
        self.C, self.c = moments(E)
        self.S, self.s = moments(E @ E)

    def push(self, x, rate, turn):
        """Elastic and inertia forces (n,) at rest in the frame."""
        return self.force(x) + rate**2 * (self.S @ x + self.s) + turn * (self.C @ x + self.c)

    def stiffness(self, x, rate, turn):
        """Its derivative by x."""
        return self.tangent(x) + rate**2 * self.S + turn * self.C

    def steady(self, rate, steps=1):
        """Displacements (n,) in the steady spin, the centrifugal forces raised in steps."""
        x = np.zeros(len(self.free))
        for part in rate * np.sqrt(np.arange(1, steps + 1) / steps):
            for _ in range(30):
                move = splu(sparse.csc_array(self.stiffness(x, part, 0.0))).solve(-self.push(x, part, 0.0))
                x = x + move
                if np.abs(move).max() <= 1e-10 * np.abs(x).max():
                    break
            else:
                raise RuntimeError(f"Newton steps did not converge at the rate {part}")
        return x

    def frequencies(self, rate, count):
        """The lowest `count` frequencies (count,) of small motions about the steady spin."""
        x = self.steady(rate, 4) if rate else np.zeros(len(self.free))
        return gyroscopic_frequencies(self.M, 2 * rate * self.C, self.stiffness(x, rate, 0.0), count)

    def motion(self, rate: Callable, turn: Callable, rows, times):
        """rows @ x (n_t, k) at equidistant times of the motion from rest, spun at rate(t) with the slope turn(t)."""
        state = State(*(np.zeros(len(self.free)) for _ in range(3)))
        state = State(state.x, state.v, splu(self.M).solve(-self.push(state.x, rate(times[0]), turn(times[0]))))
        step, out = Step(self, times[1] - times[0]), [rows @ state.x]
        for t in times[:-1]:
            middle = t + (1 - step.late_f) * step.h
            state = step.next_state(state, rate(middle), turn(middle))
            out.append(rows @ state.x)
        return np.array(out)


@dataclass(frozen=True)
class State:
    """Displacements, velocities and accelerations (n,)."""

    x: np.ndarray
    v: np.ndarray
    a: np.ndarray


class Step:
    """Steps h of the generalised-alpha method (Chung and Hulbert, J. Appl. Mech. 60 (1993) 371).

    The tangent of Newton's method is kept for as long as ten corrections do. high: spectral radius at infinity.
    """

    def __init__(self, spun: Spun, h: float, high: float = 0.8):
        self.spun, self.h, self.solver = spun, h, None
        self.late_m, self.late_f = (2 * high - 1) / (high + 1), high / (high + 1)
        self.gamma = 0.5 - self.late_m + self.late_f
        self.beta = (1 - self.late_m + self.late_f) ** 2 / 4

    def state(self, old: State, x) -> State:
        a = (x - old.x - self.h * old.v) / (self.beta * self.h**2) - (1 / (2 * self.beta) - 1) * old.a
        return State(x, old.v + self.h * ((1 - self.gamma) * old.a + self.gamma * a), a)

    def middle(self, old: State, new: State) -> State:
        f, m = self.late_f, self.late_m
        return State(*((1 - w) * q + w * p for w, p, q in ((f, old.x, new.x), (f, old.v, new.v), (m, old.a, new.a))))

    def factorised(self, x, rate, turn):
        spun, h = self.spun, self.h
        gyroscopic = self.gamma / (self.beta * h) * 2 * rate * spun.C
        inertia = (1 - self.late_m) / (self.beta * h**2) * spun.M
        return splu(sparse.csc_array(inertia + (1 - self.late_f) * (gyroscopic + spun.stiffness(x, rate, turn))))

    def next_state(self, old: State, rate, turn) -> State:
        """The state a step later, the spin given in its middle."""
        spun, x = self.spun, old.x + self.h * old.v + self.h**2 / 2 * old.a
        for k in range(30):
            new = self.state(old, x)
            at = self.middle(old, new)
            if self.solver is None or k == 10:
                self.solver = self.factorised(at.x, rate, turn)
            rest = spun.M @ at.a + 2 * rate * (spun.C @ at.v) + spun.push(at.x, rate, turn)
            move = self.solver.solve(-rest)
            x = x + move
            if np.abs(move).max() <= 1e-9 * np.abs(x).max():
                return self.state(old, x)
        raise RuntimeError("Newton steps did not converge within a time step; take shorter ones")
