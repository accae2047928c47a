"""Arches in ten coordinates, up to a rise of five thicknesses: both limit points, sideways buckling, and in motion."""

from __future__ import annotations

import numpy as np
import pytest
from support.full_solution import Full, Reduced, solved, stepped_motion
from support.nonlinear_models import METAL
from test_large_deflection import PINS, H

from femflex.fem import Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import line
from femflex.reduction import cantilever_modes, strain_tensors, with_attachment, with_responses
from femflex.reduction.boundary.clamps import held_dofs

CLAMPED = ("x", "y", "z", "rx", "ry", "rz")
SUPPORTS = {"hinged": PINS, "clamped": CLAMPED}
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


def responding(structure, clamp, group, deflection, modes=1, count=8):
    """One mode, the load's own shape and eight responses: ten coordinates; or more of them."""
    first = with_attachment(structure, cantilever_modes(structure, clamp, modes), [], {group: ["z"]})
    shapes = with_responses(structure, first, count, deflection, loads={group: ["z"]})
    assert shapes.n_modes == modes + 1 + count
    return shapes


def path(full, load, step, weight, until):
    """Factors (k,) and states (k, n) along a path of equilibria, steps as long as they settle (Riks)."""
    x, factor, way = np.zeros_like(load), 0.0, None
    factors, states, size = [0.0], [x], step
    while not until(x) and len(factors) < 700:
        v = solved(full.tangent(x), load)
        length = np.sqrt(weight @ v**2) * (1 if way is None or weight @ (way * v) > 0 else -1)
        for _ in range(12):
            new, f, settled = x + size * v / length, factor + size / length, False
            for _ in range(8):
                own, answer = solved(full.tangent(new), np.column_stack([f * load - full.force(new), load])).T
                more = (size * abs(length) - (weight * v) @ (new - x + own) * np.sign(length)) / np.sign(length)
                more /= weight @ (v * answer)
                new, f = new + own + more * answer, f + more
                settled = np.sqrt(weight @ (own + more * answer) ** 2) < 1e-8 * size
                if settled:
                    break
            if settled and np.sqrt(weight @ (new - x) ** 2) < 1.3 * size:
                break
            size /= 2
        else:
            raise RuntimeError(f"the path could not be followed beyond the load factor {factor}")
        way, x, factor, size = new - x, new, f, min(step, 1.5 * size)
        factors.append(factor)
        states.append(x)
    return np.array(factors), np.array(states)


def loads_beside(reduced, load, factors, states, ways):
    """Load factors of reduced equilibria as far along the ways of a path as its states are."""
    found = []
    for factor, state, way in zip(factors, states, ways, strict=True):
        x, row = state.copy(), way / np.linalg.norm(way)
        for _ in range(30):
            rest = np.append(factor * load - reduced.force(x), row @ (state - x))
            K = np.block([[reduced.tangent(x), -load[:, None]], [row[None], np.zeros((1, 1))]])
            step = np.linalg.solve(K, rest)
            x, factor = x + step[:-1], factor + step[-1]
            if np.abs(step[:-1]).max() < 1e-9 * np.abs(x).max():
                break
        else:
            raise RuntimeError("no reduced equilibrium was found beside a state of the path")
        found.append(factor)
    return np.array(found)


def stable_part(full, load, weight, crown, rise):
    """Where states can stand: up to the first limit point and from the last one on, to 1.3 times the first's load."""
    factors, states = path(full, load, 0.4 * H, weight, lambda x: crown @ x > 2.3 * rise)
    least = [np.linalg.eigvalsh(full.tangent(x).toarray())[0] for x in states]
    first = factors[: int(np.argmax(np.array(least) <= 0)) or None].max()
    stands = (np.array(least) > 0) & (factors != 0) & (np.abs(factors) < 1.3 * first)
    ways = np.gradient(states, axis=0)
    return first, factors[stands], states[stands], ways[stands]


STANDING = [
    *(("clamped", k, group) for k in (2, 3, 4, 5) for group in ("crown", "off")),
    *(("hinged", k, group) for k in (1, 2, 3) for group in ("crown", "off")),
    ("hinged", 4, "crown"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("support", "thicknesses", "group"), STANDING)
def test_where_an_arch_can_stand_its_load_is_that_of_all_elements(support, thicknesses, group):
    """Within 1 % of the load at the first limit point, both limit points included."""
    rise = thicknesses * H
    structure, clamp = arch(rise), dict.fromkeys(("start", "end"), SUPPORTS[support])
    full = Full(structure, held_dofs(structure, clamp))
    inside = structure.translation.tocsc()[:, full.free]
    weight = np.asarray(inside.multiply(inside).sum(axis=0)).ravel()
    load, crown = row_of(structure, group), row_of(structure, "crown")[full.free]
    first, factors, states, ways = stable_part(full, load[full.free], weight, crown, rise)
    shapes = responding(structure, clamp, group, 2.5 * rise)
    project = (structure.M @ shapes.phi)[full.free]
    reduced = Reduced(strain_tensors(structure, shapes.phi))
    found = loads_beside(reduced, shapes.phi.T @ load, factors, states @ project, ways @ project)
    assert np.ptp(states @ crown) > 1.3 * rise  # both sides of the snap
    assert np.abs(found - factors).max() < 0.01 * first


@pytest.mark.slow
def test_a_sinusoidal_arch_buckles_under_the_load_of_fung_and_kaplan():
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
            x, factor = held(reduced, load, fall, x, factor, at)
        step = (rise - start) / 100
        while abs(step) > 1e-6 * rise:
            tried, push = held(reduced, load, fall, x, factor, stands + step)
            if np.linalg.eigvalsh(reduced.tangent(tried))[0] > 0:
                x, factor, stands = tried, push, stands + step
            else:
                step /= 2
        found.append(factor)
    least = np.sqrt(rise**2 - 16 * r**2)
    exact = EI * np.pi**4 * np.array([rise + 3 * least, rise - 3 * least])
    np.testing.assert_allclose(found, exact, atol=0.01 * exact[0])


def held(reduced, load, row, x, factor, at):
    """The equilibrium with row . x held, and its load factor."""
    for _ in range(40):
        rest = np.append(factor * load - reduced.force(x), at - row @ x)
        K = np.block([[reduced.tangent(x), -load[:, None]], [row[None], np.zeros((1, 1))]])
        step = np.linalg.solve(K, rest)
        x, factor = x + step[:-1], factor + step[-1]
        if np.abs(step[:-1]).max() < 1e-10 * np.abs(x).max():
            return x, factor
    raise RuntimeError(f"no equilibrium found at {at}")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("support", "group", "counts", "bound"),
    [("clamped", "crown", (1, 8), 0.01), ("hinged", "off", (1, 8), 0.05), ("hinged", "off", (3, 10), 0.03)],
)
def test_under_a_load_put_on_at_once_an_arch_snaps_through_when_all_elements_do(support, group, counts, bound):
    """1.3 times the load that it can stand at rest, 5 % of critical damping: the crown through the snap and after it,

    root mean square over its range. The offset load takes the hinged arch sideways, which wants more shapes in motion.
    """
    rise = 3 * H
    structure, clamp = arch(rise), dict.fromkeys(("start", "end"), SUPPORTS[support])
    full = Full(structure, held_dofs(structure, clamp))
    load, crown = row_of(structure, group), row_of(structure, "crown")
    inside = structure.translation.tocsc()[:, full.free]
    weight = np.asarray(inside.multiply(inside).sum(axis=0)).ravel()
    first = path(full, load[full.free], 0.4 * H, weight, lambda x: crown[full.free] @ x > rise)[0]
    push = 1.3 * first[: np.argmax(np.diff(first) < 0) + 1].max() * load
    shapes = responding(structure, clamp, group, 2.5 * rise, *counts)
    M, w = structure.M[full.free][:, full.free], shapes.omega[0]
    dt, drag, count = 2 * np.pi / w / 120, 0.1 * w, 600
    exact = stepped_motion(full, M, drag * M, push[full.free], dt, count) @ crown[full.free]
    one = np.eye(shapes.n_modes)
    reduced = Reduced(strain_tensors(structure, shapes.phi))
    found = stepped_motion(reduced, one, drag * one, shapes.phi.T @ push, dt, count) @ (shapes.phi.T @ crown)
    assert exact[0] == 0.0 and exact.max() > 1.7 * rise  # snapped
    assert np.sqrt(np.mean((found - exact) ** 2)) < bound * np.ptp(exact)
    assert found[-1] == pytest.approx(exact[-1], abs=0.05 * np.ptp(exact))
