"""A travelling beam that keeps its length, to third order, from a wall: virtual work on polynomials of its own.

Nothing here comes from femflex. A point at xi = x / L stands at (x + u, v, w), u = -1/2 int_0^x (v'^2 + w'^2) dx, and
moves along with c = U (1 - xi) / L (support.pde). Its accelerations (A + D^2 u, D^2 v, D^2 w) do work on the virtual
displacements (-int v' dv' dx, dv, dw), and the energy is that of the curvature in space, kappa_a = a'' + a' (v' v'' +
w' w''): EI / 2 int [v''^2 + w''^2 + (v' v'' + w' w'')^2] dx.
"""

import numpy as np
from scipy.integrate import solve_ivp

from support.pde import CLAMPED_FREE, basis


def swing(length, shapes, times, EI=1.0, m=1.0, count=5, taper=None, rtol=1e-9):
    """Deflections (n_t, k) of the tip of a beam that begins at rest in w or v = shapes (k functions of xi) [m].

    length: t -> (L, U, A); taper: sigma -> factors on (m, EI), of the material at a distance sigma [m] from the tip.
    """
    psi = basis(CLAMPED_FREE, count)
    xi, w = np.polynomial.legendre.leggauss(6 * count + 20)
    xi, w = (xi + 1) / 2, w / 2
    Y, Y1, Y2 = (np.array([(p.deriv(d) if d else p)(xi) for p in psi]).T for d in range(3))
    S1 = np.einsum("qk,ql->qkl", Y1, Y1)  # derivatives by xi of S = int_0 psi_k' psi_l' dxi
    S2 = np.einsum("qk,ql->qkl", Y2, Y1) + np.einsum("qk,ql->qkl", Y1, Y2)
    products = [[psi[k].deriv() * psi[l].deriv() for l in range(count)] for k in range(count)]
    S = np.array([[p.integ(lbnd=0)(xi) for p in row] for row in products]).transpose(2, 0, 1)
    M = Y.T @ (w[:, None] * Y)
    k = len(shapes)

    def rate(t, x):
        L, U, A = (float(value) for value in length(t))
        a, da = x.reshape(2, k, count)
        density, stiffness = (1.0, 1.0) if taper is None else taper(L * (1 - xi))
        dm, dEI = w * m * density, w * EI * stiffness
        c, ct = U / L * (1 - xi), (A / L - 2 * U**2 / L**2) * (1 - xi)
        n, n1, n2 = 1 / L, -U / L**2, 2 * U**2 / L**3 - A / L**2  # 1 / L and its rates
        Sa, S1a, S2a, Sda = S @ a.T, S1 @ a.T, S2 @ a.T, S @ da.T  # (q, count, k)
        inner = lambda left, right: np.einsum("kc,qck->q", left, right)  # noqa: E731
        u1 = -n / 2 * inner(a, S1a)
        still = -(n * inner(da, Sda) + 2 * n1 * inner(a, Sda) + n2 / 2 * inner(a, Sa))  # u_tt without a S dda
        still += 2 * c * -(n * inner(da, S1a) + n1 / 2 * inner(a, S1a)) + c**2 * -n / 2 * inner(a, S2a) + ct * u1
        across = 2 * c[:, None] * (Y1 @ da.T) + c[:, None] ** 2 * (Y2 @ a.T) + ct[:, None] * (Y1 @ a.T)
        slope, bend = Y1 @ a.T / L, Y2 @ a.T / L**2
        ab = np.sum(slope * bend, axis=1)[:, None]
        force = -np.einsum("q,qc,qk->kc", dm, Y, across) + np.einsum("q,qck->kc", n * dm * (A + still), Sa)
        force -= ((dEI[:, None] * (bend + ab * slope)).T @ Y2) / L**2 + ((dEI[:, None] * ab * bend).T @ Y1) / L
        mass = np.kron(np.eye(k), (Y * dm[:, None]).T @ Y)
        pull = Sa.transpose(0, 2, 1).reshape(len(xi), -1)
        return np.concatenate([da.ravel(), np.linalg.solve(mass + n**2 * (pull.T * dm) @ pull, force.ravel())])

    start = np.array([np.linalg.solve(M, Y.T @ (w * shape(xi))) for shape in shapes])
    x0 = np.concatenate([start.ravel(), np.zeros(k * count)])
    found = solve_ivp(rate, (times[0], times[-1]), x0, "DOP853", times, rtol=rtol, atol=1e-12).y.T
    return found[:, : k * count].reshape(-1, k, count) @ np.array([p(1.0) for p in psi])
