"""Test: arches in ten coordinates, up to a rise of five thicknesses: limit points, buckling and motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.full_solution import Reduced
from support.nonlinear_models import METAL

from femflex.fem import Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import line
from femflex.reduction import (
    cantilever_modes,
    reduce_structure,
    strain_tensors,
    with_attachment,
    with_derivatives,
    with_responses,
)

H = 0.01
PINS = ("x", "y", "z", "rx", "rz")
ELEMENTS = 20


def arch(rise, place=None, thickness=H):
    """A circular arch of unit span, or one of other places, with groups "crown" and, beside it, "off"."""
    radius = (0.25 + rise**2) / (2 * rise)
    half = np.arcsin(0.5 / radius)

    def circle(t):
        angle = (2 * t - 1) * half
        return [0.5 + radius * np.sin(angle), 0.0, radius * (np.cos(angle) - np.cos(half))]

    mesh = line(place or circle, ELEMENTS)
    mesh = mesh.with_groups(points={"crown": [ELEMENTS // 2], "off": [ELEMENTS // 2 - 1]})
    section = Rectangle(0.03, thickness)
    return build_structure(mesh, [Member("line", "beam", section, METAL, {"extent": 1.0})])


def row_of(structure, group):
    """The fall of a group's node (n_dof,)."""
    node = structure.mesh.group_points(group)[0]
    return -structure.translation[[3 * node + 2]].toarray()[0]


@pytest.mark.slow
def test_buckling_of_sinusoidal_arch_matches_fung_kaplan():
    """Hinged, of rise a, under q sin(pi x / L): w = A sin(pi x / L) while it stands, r^2 = I / A, and

        q = EI (pi / L)^4 [a - A + A (a^2 - A^2) / (4 r^2)]

    until it buckles sideways into two half waves, where its thrust is four times Euler's: A^2 = a^2 - 16 r^2
    (Y. C. Fung and A. Kaplan, NACA TN 2840 (1952)). So it buckles on its way down, and on its way up again.
    The responses are those to an even load.
    """
    h = H / 5  # so shallow that (pi a / L)^2 is nothing beside the bound
    rise, r, EI = 4 * h, h / np.sqrt(12), METAL.E * 0.03 * h**3 / 12
    structure = arch(rise, lambda t: [t, 0.0, rise * np.sin(np.pi * t)], h)
    clamp = dict.fromkeys(("start", "end"), PINS)
    modes = with_attachment(structure, cantilever_modes(structure, clamp, 1), ["z"])
    shapes = with_responses(structure, modes, 12, 2.5 * rise, ["z"])
    wave = np.sin(np.pi * structure.mesh.points[:, 0]) / ELEMENTS  # works on a sine as q sin does
    load = shapes.phi.T @ -(structure.translation.T @ np.kron(wave, [0.0, 0.0, 1.0]))
    fall = shapes.phi.T @ row_of(structure, "crown")
    reduced, found = Reduced(strain_tensors(structure, shapes.phi)), list[float]()
    for start in (0.0, 2.2 * rise):
        x, factor, stands = np.zeros(14), 0.0, start
        for at in np.linspace(0.0, start, 40)[1:] if start else ():
            x, factor = equilibrium_at(reduced, load, fall, x, factor, at)
        step = (rise - start) / 100
        while abs(step) > 1e-6 * rise:
            tried, push = equilibrium_at(reduced, load, fall, x, factor, stands + step)
            if np.linalg.eigvalsh(reduced.tangent(tried))[0] > 0:
                x, factor, stands = tried, push, stands + step
            else:
                step /= 2
        found.append(factor)
    least = np.sqrt(rise**2 - 16 * r**2)
    exact = EI * np.pi**4 * np.array([rise + 3 * least, rise - 3 * least])
    np.testing.assert_allclose(found, exact, atol=0.01 * exact[0])


def equilibrium_at(reduced, load, row, x, factor, at):
    """The equilibrium with prescribed row . x = at, and its load factor."""
    for _ in range(40):
        rest = np.append(factor * load - reduced.force(x), at - row @ x)
        K = np.block([[reduced.tangent(x), -load[:, None]], [row[None], np.zeros((1, 1))]])
        step = np.linalg.solve(K, rest)
        x, factor = x + step[:-1], factor + step[-1]
        if np.abs(step[:-1]).max() < 1e-10 * np.abs(x).max():
            return x, factor
    raise RuntimeError(f"no equilibrium found at {at}")


@pytest.mark.parametrize("part, snaps", [(0.99, False), (1.01, True)])
def test_sinusoidal_arch_snaps_under_a_sudden_load(part, snaps):
    """Held in one half wave, under q sin(pi x / L) that is there at once, it passes its unstable equilibrium where q
    works as much as the static law of Fung and Kaplan stores on the way (N. J. Hoff and V. G. Bruce, J. Math. Phys. 32
    (1954) 276): q = max of int_A^a (...) dA / (a - A) on the near side.
    """
    h = H / 5
    rise, r, EI = 4 * h, h / np.sqrt(12), METAL.E * 0.03 * h**3 / 12
    A = np.linspace(rise, -rise, 4001)[1:]
    stored = (rise - A) ** 2 / 2 + (rise**2 - A**2) ** 2 / (16 * r**2)
    mean = stored / (rise - A)
    first = int(np.argmax(np.diff(mean) < 0))
    q = part * EI * np.pi**4 * mean[first]

    structure = arch(rise, lambda t: [t, 0.0, rise * np.sin(np.pi * t)], h)
    every = cantilever_modes(structure, dict.fromkeys(("start", "end"), PINS), 6)
    modes = with_derivatives(structure, every.picked([int(np.abs(row_of(structure, "crown") @ every.phi).argmax())]))
    body = reduce_structure(structure, modes, strain="condensed")
    only_first = np.eye(body.n_modes)[0]  # the others at rest
    wave = np.sin(np.pi * structure.mesh.points[:, 0]) / ELEMENTS
    load = modes.phi[:, 0] @ -(structure.translation.T @ np.kron(wave, [0.0, 0.0, q]))
    crown = modes.phi[:, 0] @ row_of(structure, "crown")
    rate = lambda t, x: [x[1], load - body.strain.force(x[0] * only_first)[0]]  # noqa: E731
    period = 2 * np.pi / np.sqrt(body.strain.V1[0, 0])
    reached = solve_ivp(rate, (0.0, 10 * period), [0.0, 0.0], rtol=1e-8, atol=1e-10).y[0] * crown
    assert (reached.max() > 1.5 * rise) == snaps
