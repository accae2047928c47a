"""A beam that deploys along the orbit normal from a craft held in a circular orbit: its own Galerkin solution.

Written from the equations of a travelling beam in axes that turn at n, with the craft's reaction (the centre of mass
stays on the orbit); nothing here comes from femflex. x along the orbit normal, y up, z forward:

    D^2 v + dd_y - 2n (D w + d_z') - 3 n^2 (v + d_y) + EI v_xxxx / m' - (N v_x)_x / m' = 0
    D^2 w + dd_z + 2n (D v + d_y')                   + EI w_xxxx / m' - (N w_x)_x / m' = 0
    N_x = m' (A + n^2 x + dd_x + n^2 d_x),  N(L) = 0,      M d = -int m' (x, v, w) dx
"""

import numpy as np
from pde import CLAMPED_FREE, basis
from scipy.integrate import solve_ivp


def held_beam(length, shape, times, EI, m, M, n, count=8, rtol=1e-9):
    """Tip (v, w) over time (n_t, 2); shape(xi): both deflections at the start, at rest in a fixed place (U(0) = 0)."""
    psi = basis(CLAMPED_FREE, count)
    xi, weight = np.polynomial.legendre.leggauss(3 * count + 10)
    xi, weight = (xi + 1) / 2, weight / 2
    Y = [np.array([(p.deriv(d) if d else p)(xi) for p in psi]).T for d in (0, 1, 2, 3, 4)]
    mass = Y[0].T @ (weight[:, None] * Y[0])
    total = weight @ Y[0]

    def rate(t, x):
        L, U, A = (float(value) for value in length(t))
        a, da = x[: 2 * count].reshape(2, count), x[2 * count :].reshape(2, count)
        c = U / L * (1 - xi)
        ct = (A / L - U**2 / L**2) * (1 - xi)
        d_x, dd_x = -m * L**2 / 2 / M, -m * (U**2 + L * A) / M
        s = L * xi
        N = -m * ((A + dd_x + n**2 * d_x) * (L - s) + n**2 * (L**2 - s**2) / 2)
        N_x = m * (A + n**2 * s + dd_x + n**2 * d_x)
        field, moving, convected = [], [], []
        for k in range(2):
            y, y1, y2, y4 = (Y[d] @ a[k] for d in (0, 1, 2, 4))
            v, v1 = Y[0] @ da[k], Y[1] @ da[k]
            field.append(y)
            moving.append(v + c * y1)
            convected.append(2 * c * v1 + c**2 * y2 + (ct - U / L * c) * y1)
            elastic = EI / (m * L**4) * y4 - (N * y2 / L**2 + N_x * y1 / L) / m
            convected[-1] = (convected[-1], elastic)
        d = [-m * L / M * (weight @ f) for f in field]
        rates = [-m * L / M * (weight @ f) for f in moving]  # clamped: no flux of transverse place
        force = [
            -2 * n * (moving[1] + rates[1]) - 3 * n**2 * (field[0] + d[0]),
            2 * n * (moving[0] + rates[0]),
        ]
        effective = mass - m * L / M * np.outer(total, total)
        out = []
        for k in range(2):
            material, elastic = convected[k]
            known = material - m * L / M * (weight @ material) + elastic + force[k]
            out.append(-np.linalg.solve(effective, Y[0].T @ (weight * known)))
        return np.concatenate([da.ravel(), *out])

    start = np.linalg.solve(mass, Y[0].T @ (weight * shape(xi)))
    x0 = np.concatenate([start, start, np.zeros(2 * count)])
    found = solve_ivp(rate, (times[0], times[-1]), x0, "DOP853", times, rtol=rtol, atol=1e-11).y.T
    tip = np.array([p(1.0) for p in psi])
    return np.stack([found[:, :count] @ tip, found[:, count : 2 * count] @ tip], axis=1)
