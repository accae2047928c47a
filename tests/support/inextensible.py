"""A travelling beam that keeps its length, to third order: virtual work on polynomials of its own.

Nothing here comes from femflex. A point at xi = x / L stands at (x + u, v, w), u = -1/2 int_0^x (v'^2 + w'^2) dx, and
moves along with c = U (1 - xi) / L (support.pde). Its acceleration (A + D^2 u, D^2 v, D^2 w) = B dda + b works on the
virtual displacements B = (-int v' dv' dx, dv, dw), and the energy is that of the curvature in space, kappa_a = a'' +
a' (v' v'' + w' w'') / 2: EI / 2 int [v''^2 + w''^2 + (v' v'' + w' w'')^2] dx. In an orbit as in support.orbit_beam.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from support.pde import CLAMPED_FREE, basis


class Orbiting(NamedTuple):
    """A craft of a mass [kg], beam included, held in a circular orbit: N and l in the beam's axes, mean motion n."""

    mass: float
    normal: np.ndarray
    up: np.ndarray
    n: float


def swing(length, shapes, times, EI=1.0, m=1.0, count=3, taper=None, orbit=None, rtol=1e-5):
    """Deflections (n_t, k) of the tip of a beam that begins at rest in (v, w) = shapes (k functions of xi) [m].

    length: t -> (L, U, A); taper: sigma -> factors on (m, EI), of the material at a distance sigma [m] from the tip.
    """
    psi = basis(CLAMPED_FREE, count)
    xi, weight = np.polynomial.legendre.leggauss(6 * count + 4)
    xi, weight = (xi + 1) / 2, weight / 2
    Y, Y1, Y2 = (np.array([(p.deriv(d) if d else p)(xi) for p in psi]).T for d in range(3))
    S1 = np.einsum("qk,ql->qkl", Y1, Y1)  # derivatives by xi of S = int_0 psi_k' psi_l' dxi
    S2 = np.einsum("qk,ql->qkl", Y2, Y1) + np.einsum("qk,ql->qkl", Y1, Y2)
    products = [[psi[k].deriv() * psi[l].deriv() for l in range(count)] for k in range(count)]
    S = np.array([[p.integ(lbnd=0)(xi) for p in row] for row in products]).transpose(2, 0, 1)
    k = len(shapes)
    B = np.zeros((len(xi), 1 + k, k * count))
    for i in range(k):
        B[:, 1 + i, i * count : (i + 1) * count] = Y
    if orbit is not None:
        W = orbit.n**2 * (np.outer(orbit.normal, orbit.normal) - 3 * np.outer(orbit.up, orbit.up))

    def inner(a, Sb):
        return (a.T * Sb).sum(axis=(1, 2))

    def rate(t, x):
        L, U, A = (float(value) for value in length(t))
        a, da = x.reshape(2, k, count)
        density, stiffness = (1.0, 1.0) if taper is None else taper(L * (1 - xi))
        dm, dEI = weight * m * density, weight * EI * stiffness  # of L
        c, ct = U / L * (1 - xi), (A / L - 2 * U**2 / L**2) * (1 - xi)
        n, n1, n2 = 1 / L, -U / L**2, 2 * U**2 / L**3 - A / L**2  # 1 / L and its rates
        Sa, S1a, S2a, Sda = S @ a.T, S1 @ a.T, S2 @ a.T, S @ da.T  # (q, count, k)
        u, u1, u2 = (-n / 2 * inner(a, s) for s in (Sa, S1a, S2a))
        ut, u1t = -n * inner(a, Sda) + n1 / n * u, -n * inner(da, S1a) + n1 / n * u1
        utt = -n * inner(da, Sda) - 2 * n1 * inner(a, Sda) + n2 / n * u  # without a S dda
        v, v1, v2, vt, v1t = Y @ a.T, Y1 @ a.T, Y2 @ a.T, Y @ da.T, Y1 @ da.T
        b = np.column_stack([utt, np.zeros_like(v)]) + 2 * c[:, None] * np.column_stack([u1t, v1t])
        b += c[:, None] ** 2 * np.column_stack([u2, v2]) + ct[:, None] * np.column_stack([u1, v1])
        b[:, 0] += A
        B[:, 0] = -n * Sa.swapaxes(1, 2).reshape(len(xi), -1)
        rows = B.reshape(-1, k * count)
        weighted = np.repeat(dm, 1 + k)[:, None] * rows
        mass = weighted.T @ rows
        if orbit is not None:  # the craft gives way, and its axes turn
            place, velocity = np.column_stack([L * xi + u, v]), np.column_stack([ut + c * u1, vt + c[:, None] * v1])
            velocity[:, 0] += U
            share = L * np.tensordot(dm, B, axes=1)
            mass -= share.T @ share / (L * orbit.mass)
            back = (L * dm @ b + m * U**2 * np.eye(1 + k)[0]) / orbit.mass
            place, velocity = (f - L * dm @ f / orbit.mass for f in (place, velocity))
            b += 2 * orbit.n * np.cross(orbit.normal, velocity) + place @ W - back
        bend, slope = v2 / L**2, v1 / L
        ab = np.sum(slope * bend, axis=1)[:, None]
        force = -(b.ravel() @ weighted)
        force -= ((dEI[:, None] * (bend + ab * slope)).T @ Y2 / L**2 + (dEI[:, None] * ab * bend).T @ Y1 / L).ravel()
        return np.concatenate([da.ravel(), np.linalg.solve(mass, force)])

    start = np.array([np.linalg.solve(Y.T @ (weight[:, None] * Y), Y.T @ (weight * shape(xi))) for shape in shapes])
    x0 = np.concatenate([start.ravel(), np.zeros(k * count)])
    found = solve_ivp(rate, (times[0], times[-1]), x0, "DOP853", times, rtol=rtol, atol=1e-10).y.T
    return found[:, : k * count].reshape(-1, k, count) @ np.array([p(1.0) for p in psi])
