"""A hub with equal panels slewed about a fixed axis by a torque, one panel solved with all its finite elements.

The panels lie so about the hub that all bend alike and leave its middle in place, as two do that face each other; the
hub then only turns, by the angle theta. With the tables of `full_spin` over one panel, n panels, Om = thetad:

    M xdd + D xd + 2 Om C xd + thetadd (c + C x) + Om^2 (s + S x) + f(x) = 0
    (I + n J) thetadd + n (c + C x).xdd - 2 n Om (s + S x).xd = T(t),      J = -(s0 + 2 s.x + x.S x)

the second being the rate of the angular momentum I Om + n (J Om + (c + C x).xd). f is that of the elements: of the
quadratic strain of plates (`femflex.fem.plate.strain`), of Green's full strain, geometrically exact, for solids.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from femflex.reduction import cantilever_modes
from femflex.reduction.boundary.rigid import held_dofs
from support.full_spin import Spun, mass_points, skew

SPECTRAL = 0.8  # spectral radius at infinite frequency
SLOW = 0.05  # a correction over the one before from which on the tangent is made anew
CLOSE = 1e-9  # last correction over the displacement


@dataclass(frozen=True)
class Hub:
    """Its inertia about the axis, how many panels it carries, and the torque T(t), which may jump at `breaks`."""

    inertia: float
    panels: int
    torque: Callable[[float], float]
    breaks: Sequence[float] = ()


class Slewed(Spun):
    """A panel of a Structure, clamped at a group to a hub; damped by a ratio of its lowest modes' critical damping."""

    def __init__(self, structure, clamp, axis, hub, ratio=0.0, damped=8):
        super().__init__(structure, held_dofs(structure, clamp), axis)
        self.hub = hub
        dm, rho, _ = mass_points(structure)
        E = skew(np.asarray(axis) / np.linalg.norm(axis))
        self.s0 = np.einsum("p,pa,ab,pb->", dm, rho, E @ E, rho)
        modes = cantilever_modes(structure, clamp, damped)
        self.rows, self.drag = (structure.M @ modes.phi)[self.free], 2 * ratio * modes.omega

    def unbalanced_forces(self, at, torque):
        """Unbalanced forces (n,) and torque in a state."""
        x, v, a, (_, rate, turn) = at
        lever, pull = self.c + self.C @ x, self.s + self.S @ x
        push = self.M @ a + self.rows @ (self.drag * (self.rows.T @ v)) + 2 * rate * (self.C @ v)
        push += self.force(x) + turn * lever + rate**2 * pull
        n, J = self.hub.panels, -(self.s0 + (self.s + pull) @ x)
        moment = (self.hub.inertia + n * J) * turn + n * (lever @ a - 2 * rate * (pull @ v)) - torque
        return push, moment

    def momentum(self, at):
        """Angular momentum about the axis in a state."""
        x, v, _, (_, rate, _) = at
        pull, n = self.s + self.S @ x, self.hub.panels
        return (self.hub.inertia - n * (self.s0 + (self.s + pull) @ x)) * rate + n * ((self.c + self.C @ x) @ v)

    def pushed(self, at, torque):
        """The state with the accelerations that so much more torque adds."""
        x, v, a, (angle, rate, turn) = at
        n, lever = self.hub.panels, self.c + self.C @ x
        answer = splu(sparse.csc_array(self.M)).solve(lever)
        J = -(self.s0 + (2 * self.s + self.S @ x) @ x)
        more = torque / (self.hub.inertia + n * J - n * lever @ answer)
        return x, v, a - more * answer, np.array([angle, rate, turn + more])

    def motion(self, rows, until, h):
        """Times, rows @ x (n_t, k), the hub's angle and the angular momentum, from rest in steps of about h."""
        zero, t, torque = np.zeros(len(self.free)), 0.0, 0.0
        state, out = (zero, zero, zero, np.zeros(3)), [(0.0, rows @ zero, 0.0, 0.0)]
        for end in [b for b in sorted(self.hub.breaks) if 0.0 < b < until] + [until]:
            begin, count = t, int(np.ceil((end - t) / h - 1e-9))
            step = Alpha(self, (end - begin) / count)
            state = self.pushed(state, self.hub.torque(np.nextafter(begin, end)) - torque)
            for k in range(count):
                state = step.next_state(state, self.hub.torque(begin + (k + step.late) * step.h))
                t = begin + (k + 1) * step.h
                out.append((t, rows @ state[0], state[3][0], self.momentum(state)))
            torque = self.hub.torque(np.nextafter(end, begin))
        return tuple(np.array(column) for column in zip(*out, strict=True))


class Alpha:
    """Steps h of the generalised-alpha method for panel and hub together (Chung and Hulbert, 1993)."""

    def __init__(self, slewed: Slewed, h: float):
        self.slewed, self.h, self.solver = slewed, h, None
        high = SPECTRAL
        self.am, self.af = (2 * high - 1) / (high + 1), high / (high + 1)
        self.gamma = 0.5 - self.am + self.af
        self.beta = (1 - self.am + self.af) ** 2 / 4
        self.late = 1 - self.af  # where in the step forces are taken

    def advanced(self, q, v, a, new):
        """Rates and accelerations that go with new positions."""
        more = (new - q - self.h * v) / (self.beta * self.h**2) - (1 / (2 * self.beta) - 1) * a
        return v + self.h * ((1 - self.gamma) * a + self.gamma * more), more

    def factorise(self, at):
        """The tangent of the panel and what couples it to the hub, in the middle of a step."""
        s, (x, _, _, (_, rate, turn)) = self.slewed, at
        self.inertia = (1 - self.am) / (self.beta * self.h**2)
        swing = (1 - self.af) * self.gamma / (self.beta * self.h) * 2 * rate * s.C
        self.solver = splu(sparse.csc_array(self.inertia * s.M + swing + (1 - self.af) * s.stiffness(x, rate, turn)))
        self.lever = self.inertia * (s.c + s.C @ x)
        self.answer = self.solver.solve(self.lever)
        n, J = s.hub.panels, -(s.s0 + (2 * s.s + s.S @ x) @ x)
        self.whole = self.inertia * (s.hub.inertia + n * J) - n * self.lever @ self.answer

    def next_state(self, old, torque):
        """The state a step later under the torque in its middle."""
        x, v, a, (angle, rate, turn) = old
        new, theta = (q + self.h * p + self.h**2 / 2 * r for q, p, r in ((x, v, a), (angle, rate, turn)))
        last, size = 0.0, np.inf
        for _ in range(40):
            vn, an = self.advanced(x, v, a, new)
            rn, tn = self.advanced(angle, rate, turn, theta)
            f, m = self.af, self.am
            hub = np.array([f * angle + (1 - f) * theta, f * rate + (1 - f) * rn, m * turn + (1 - m) * tn])
            at = (f * x + (1 - f) * new, f * v + (1 - f) * vn, m * a + (1 - m) * an, hub)
            if size > SLOW * last:
                self.factorise(at)
            last = size
            push, moment = self.slewed.unbalanced_forces(at, torque)
            move = self.solver.solve(-push)
            swing = (-moment - self.slewed.hub.panels * self.lever @ move) / self.whole
            move = move - self.answer * swing
            new, theta = new + move, theta + swing
            size = np.abs(move).max()
            if size <= CLOSE * np.abs(new).max() and abs(swing) < CLOSE * (abs(theta) + 1e-3):
                vn, an = self.advanced(x, v, a, new)
                return new, vn, an, np.array([theta, *self.advanced(angle, rate, turn, theta)])
        raise RuntimeError("Newton steps did not converge within a time step; take shorter ones")
