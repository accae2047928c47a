"""A beam that deploys from a craft held in a circular orbit, in any direction: its own Galerkin solution.

Written from the equations of a travelling beam in axes that turn at n, with the craft's reaction (the centre of mass
stays on the orbit); nothing here comes from femflex. e along the beam, f and g across; N along the orbit normal, l up;
A = n^2 (N N^T - 3 l l^T) is what turning axes and the gradient of gravity make of a place r = x e + v f + w g + d:

    D^2 r + dd + 2n N x (D r + d') + A r + (EI v_xxxx / m' - (N_x v_x)_x / m') f + ... = 0,   D x = U, D^2 x = A
    T_x = m' (A + e.dd + e.A e (x + e.d)),  T(L) = 0,      M d = -int m' (x e + v f + w g) dx
"""

import numpy as np
from scipy.integrate import solve_ivp

from support.pde import CLAMPED_FREE, basis


def held_beam(length, shape, times, EI, m, M, n, count=8, rtol=1e-9, axes=None):
    """Tip (v, w) over time (n_t, 2); shape(xi): both deflections at the start, at rest in a fixed place (U(0) = 0).

    axes: rows e, f, g in the axes orbit normal, up, forward; left out, these axes themselves
    """
    R = np.eye(3) if axes is None else np.asarray(axes, float)
    normal, up = R @ [1.0, 0.0, 0.0], R @ [0.0, 1.0, 0.0]
    field_of_place = n**2 * (np.outer(normal, normal) - 3 * np.outer(up, up))
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
        s = L * xi
        fields = [Y[0] @ a[k] for k in range(2)]
        moving = [Y[0] @ da[k] + c * (Y[1] @ a[k]) for k in range(2)]
        place = np.stack([s, *fields])
        velocity = np.stack([np.full_like(s, U), *moving])
        d = -m * np.array([L**2 / 2, *(L * (weight @ f) for f in fields)]) / M
        rates = -m * np.array([U * L, *(L * (weight @ f) for f in moving)]) / M
        dd_x = -m * (U**2 + L * A) / M
        pull = field_of_place[0, 0]
        T_x = m * (pull * (s + d[0]) + A + dd_x)
        T = -m * (pull * (L**2 - s**2) / 2 + (pull * d[0] + A + dd_x) * (L - s))
        turning = 2 * n * np.cross(normal, (velocity + rates[:, None]).T).T + field_of_place @ (place + d[:, None])
        effective = mass - m * L / M * np.outer(total, total)
        out = []
        for k in range(2):
            y1, y2, y4 = (Y[order] @ a[k] for order in (1, 2, 4))
            material = 2 * c * (Y[1] @ da[k]) + c**2 * y2 + (ct - U / L * c) * y1
            elastic = EI / (m * L**4) * y4 - (T * y2 / L**2 + T_x * y1 / L) / m
            known = material - m * L / M * (weight @ material) + elastic + turning[1 + k]
            out.append(-np.linalg.solve(effective, Y[0].T @ (weight * known)))
        return np.concatenate([da.ravel(), *out])

    start = np.linalg.solve(mass, Y[0].T @ (weight * shape(xi)))
    x0 = np.concatenate([start, start, np.zeros(2 * count)])
    found = solve_ivp(rate, (times[0], times[-1]), x0, "DOP853", times, rtol=rtol, atol=1e-11).y.T
    tip = np.array([p(1.0) for p in psi])
    return np.stack([found[:, :count] @ tip, found[:, count : 2 * count] @ tip], axis=1)
