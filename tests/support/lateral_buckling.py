"""Critical dead loads of bodies and structures, at which the tangent stiffness becomes singular."""

import numpy as np
from scipy import linalg

from femflex.reduction.boundary.rigid import free_dofs

EI, GJ, LENGTH = 1.4e4, 1.2e3, 10.0  # N m^2 about the weak axis, N m^2, m
END_LOAD, WEIGHT, MOMENT = 4.0126, 12.854, np.pi  # Timoshenko & Gere, Theory of Elastic Stability, sections 6.2 and 6.3


def of_narrow_beams(coefficient, power, ratio):
    """coefficient sqrt(EI GJ) / L^power, for the bend it starts from over sqrt((1 - EI / EI_y) (1 - GJ / EI_y))."""
    before = np.sqrt((1 - 1 / ratio) * (1 - GJ / (ratio * EI)))
    return coefficient * np.sqrt(EI * GJ) / LENGTH**power / before


def critical(body, load, unit, step=0.05, most=2.0):
    """The critical share of a unit load of a body, with generalised forces `load` (n_shapes,); inf beyond `most`.

    The work of the load includes that on dependent shapes, y = 1/2 delta.A delta.
    """
    n = body.n_modes
    A = np.tensordot(load[n:], body.slaves, axes=1) if len(body.slaves) else np.zeros((n, n))

    def tangent(d, share):
        return body.strain.tangent(d) - share * unit * A

    def force(d, share):
        return body.strain.force(d) - share * unit * (load[:n] + A @ d)

    return _first_zero(force, tangent, body.strain.V1, np.zeros(n), step, most)


def critical_of_structure(structure, clamped, load, unit, step=0.05, most=2.0):
    """The critical share of a unit load of a structure with dofs clamped."""
    free = free_dofs(structure, clamped)
    elastic = structure.internal_force

    def on_all_dofs(d):
        x = np.zeros(structure.n_dof)
        x[free] = d
        return x

    return _first_zero(
        lambda d, share: elastic.force(on_all_dofs(d))[free] - share * unit * load[free],
        lambda d, share: elastic.tangent(on_all_dofs(d))[free][:, free].toarray(),
        structure.K[free][:, free].toarray(),
        np.zeros(len(free)),
        step,
        most,
    )


def _first_zero(force, tangent, linear, d, step, most):
    """Share of the load at which the lowest eigenvalue of the tangent, over the linear stiffness, passes zero."""
    before = 1.0
    for share in np.arange(1, most / step) * step:
        for _ in range(50):
            change = np.linalg.solve(tangent(d, share), force(d, share))
            d = d - change
            if np.abs(change).max() < 1e-11 * np.abs(d).max():
                break
        lowest = linalg.eigh(tangent(d, share), linear, eigvals_only=True, subset_by_index=[0, 0])[0]
        if lowest < 0:
            return share - step + step * before / (before - lowest)
        before = lowest
    return np.inf
