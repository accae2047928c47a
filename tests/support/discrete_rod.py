"""A discrete elastic rod in a turning frame: a second formulation of the spin-up beam, with nothing of the package.

Points with mass, stretch springs between them, bending springs at the angles between neighbouring links (clamped to the
frame at the root, at half a link). In the turning frame: centrifugal, Coriolis and Euler forces. Error h^2.
"""

from __future__ import annotations

import numpy as np

EA, EI, MASS, LENGTH = 2.8e7, 1.4e4, 1.2, 10.0
OM, TS = 6.0, 15.0


def spin(t: float) -> tuple[float, float]:
    """psi' and psi'' of the prescribed turn."""
    if t >= TS:
        return OM, 0.0
    return OM / TS * (t - TS / (2 * np.pi) * np.sin(2 * np.pi * t / TS)), OM / TS * (1 - np.cos(2 * np.pi * t / TS))


def spring_forces(r: np.ndarray, h: float) -> np.ndarray:
    """Forces on the points r (n + 1, 2), the first at the root."""
    link = np.diff(r, axis=0)
    length = np.linalg.norm(link, axis=1)
    along = link / length[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    angle = np.arctan2(link[:, 1], link[:, 0])
    moment = EI / h * np.diff(angle)
    root = 2 * EI / h * angle[0]
    net = np.append(moment, 0.0) - np.insert(moment, 0, root)  # turning moment on each link
    pull = (EA / h * (length - h))[:, None] * along - (net / length)[:, None] * across
    force = np.zeros_like(r)
    force[:-1] += pull
    force[1:] -= pull
    return force


def tip_of_rod(n: int, end: float) -> np.ndarray:
    """Tip displacement (n_t, 2) of a rod of n links in the turning frame at every step up to the end [s].

    Kick, turn by Coriolis, drift: of second order, with steps half as long as the stretch waves allow.
    """
    h = LENGTH / n
    mass = np.full((n, 1), MASS * h)
    mass[-1] /= 2
    dt = h * np.sqrt(MASS / EA) / 2
    r = np.stack([h * np.arange(n + 1), np.zeros(n + 1)], axis=1)
    v, tip = np.zeros((n, 2)), []

    def pull(t: float) -> np.ndarray:
        w, dw = spin(t)
        return spring_forces(r, h)[1:] / mass + w**2 * r[1:] + dw * r[1:, ::-1] * [1, -1]

    force = pull(0.0)
    for k in range(int(end / dt)):
        t = k * dt
        v += dt / 2 * force
        turn = 2 * spin(t + dt / 2)[0] * dt
        c, s = np.cos(turn), np.sin(turn)
        v = v @ np.array([[c, -s], [s, c]])
        r[1:] += dt * v
        force = pull(t + dt)
        v += dt / 2 * force
        tip.append(r[-1] - [LENGTH, 0])
    return np.array(tip)
