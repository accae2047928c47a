"""Rotating cantilevers: exact frequencies by shooting along the beam, and those of a body in a spinning frame.

All in units of the beam: length, root mass per length and root bending stiffness are 1, so that a frequency is mu and
the spin is gamma = Omega sqrt(rho A L^4 / EI).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from femflex.dynamics import compile_system
from femflex.linear.equations import linearised
from femflex.reduction import BeamFunctions, Taper, TaperedBeam, beam_body
from femflex.system import Frame, System, weld


def uniform(x):
    return np.ones_like(x)


@dataclass(frozen=True)
class Rotating:
    """An inextensible beam that spins about z with its root at `hub`: bending stiffness along the section's axes.

    flap, lag: bending stiffness out of and in the plane of rotation at setting angle 0
    mass, bending: how they vary along x; bending of one value for both planes, or of two (2, k), lag and flap at
    setting angle 0
    setting: angle by which the section is turned about the beam
    """

    gamma: float
    hub: float = 0.0
    flap: float = 1.0
    lag: float = 1.0
    mass: Callable = uniform
    bending: Callable = uniform
    setting: float = 0.0

    def matrix(self):
        """Bending stiffness (2, 2) over deflections in the plane of rotation and out of it."""
        c, s = np.cos(self.setting), np.sin(self.setting)
        R = np.array([[c, -s], [s, c]])
        return R @ np.diag([self.lag, self.flap]) @ R.T

    def body(self, n: int):
        """The condensed body on n polynomials along y and along z."""
        c, s = np.cos(self.setting), np.sin(self.setting)
        beam = TaperedBeam(
            1.0, 1e4, self.flap, self.lag, 1.0, 1.0, root=(self.hub, 0, 0), orientation=(0, c, s),
            factors=Taper(self.mass, self.bending, uniform),
        )  # fmt: skip
        return beam_body(beam, BeamFunctions(y=n, z=n, family="polynomial"), strain="condensed")

    def frequencies(self, n: int, count: int):
        """The lowest `count` frequencies of the body in a frame that spins, about its straight state."""
        frame = Frame("spinning", np.array([0.0, 0.0, self.gamma]))
        model = compile_system(System({"beam": self.body(n)}, (weld("beam"),), frame=frame))
        found = linearised(model, 0.0, np.zeros(model.n_x)).eigenvalues().imag
        return np.sort(found[found > 0])[:count]

    def misfit(self, mu):
        """Determinant that vanishes at exact frequencies mu (k,): solutions free at the tip, clamped at the root.

        State per solution: w, slope, moment M = B w'', force S = M' - T w', each (2,); S' = -m (mu^2 + gamma^2 P) w
        with P the plane of rotation, T = gamma^2 int_x^1 m (hub + x) dx.
        """
        mu, B = np.atleast_1d(mu), np.linalg.inv(self.matrix())
        x, weight = np.polynomial.legendre.leggauss(40)

        def tension(at):
            s = at + (1 - at) * (x + 1) / 2
            return self.gamma**2 * (1 - at) / 2 * (weight @ (self.mass(s) * (self.hub + s)))

        def slope(at, y):
            w, theta, M, S = y.reshape(4, 2, 4, -1)  # quantity, direction, solution, mu
            m, T = self.mass(np.array([at]))[0], tension(at)
            curvature = np.einsum("ij,jsk->isk", B, M) / self.bending(np.array([at]))[..., 0].reshape(-1, 1, 1)
            pull = m * (mu**2 * w + self.gamma**2 * np.stack([w[0], 0 * w[1]]))
            return np.stack([theta, curvature, S + T * theta, pull]).ravel()

        start = np.zeros((4, 2, 4, len(mu)))
        for k in range(4):
            start[k // 2, k % 2, k] = 1.0
        end = solve_ivp(slope, (1.0, 0.0), start.ravel(), method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
        root = end.reshape(4, 2, 4, -1)[:2].reshape(4, 4, -1)
        size = np.linalg.norm(root, axis=(0, 1))
        return np.linalg.det(np.moveaxis(root / size, 2, 0))

    def exact(self, near, within=1e-4):
        """Exact frequencies beside those of `near` (n,): the sign of the misfit changes within a part of each."""
        low, high = near * (1 - within), near * (1 + within)
        below = np.sign(self.misfit(low))
        if np.any(np.sign(self.misfit(high)) == below):
            raise AssertionError(f"no exact frequency within {within:g} of {near}")
        for _ in range(26):
            middle = (low + high) / 2
            same = np.sign(self.misfit(middle)) == below
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        return (low + high) / 2
