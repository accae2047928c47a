"""A steep truss of two bars that buckles sideways under its load: the states of its responses, in closed form."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from support.reduction_examples import slender_beam

from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Circle
from femflex.mesh import Mesh
from femflex.reduction import cantilever_modes, free_free_modes, with_responses
from femflex.reduction.large_deflection import load_path
from femflex.reduction.large_deflection.response_states import _both_ways, _strongest
from femflex.reduction.preload.equilibrium import static_equilibrium
from femflex.reduction.preload.loads import Preload

METAL, A, H = Material(70e9, 0.3, 2700.0), 1.0, 2.0  # half span and height [m]
AREA = np.pi * 1e-4
L = np.hypot(A, H)
DEFLECTION = 1.0


@pytest.fixture(scope="module")
def truss():
    mesh = Mesh(
        np.array([[0.3 - A, 0.4, 0.5], [0.3, 0.4, 0.5 + H], [0.3 + A, 0.4, 0.5]]),
        {"line": np.array([[0, 1], [1, 2]])},
        {"legs": {"line": np.arange(2)}},
        {"feet": np.array([0, 2]), "crown": np.array([1])},
    )
    structure = build_structure(mesh, [Member("legs", "rod", Circle(0.01), METAL)])
    return structure, cantilever_modes(structure, {"feet": ("x", "y", "z"), "crown": ("y",)}, 1)


def crown(structure, states) -> np.ndarray:
    """Displacements (k, 2) of the crown along x and z."""
    u = (structure.translation @ np.array(states).T).reshape(3, 3, -1)
    assert np.abs(u[[0, 2]]).max() == 0.0 and np.abs(u[1, 1]).max() == 0.0
    return u[1, [0, 2]].T


def energy(x, z):
    """EA L / 2 times the squares of Green's strains, the crown moved by (x, z)."""
    strains = [((A + side * x) ** 2 + (H + z) ** 2 - L**2) / (2 * L**2) for side in (1, -1)]
    return METAL.E * AREA * L / 2 * sum(e**2 for e in strains)


def test_a_load_comes_upon_saddles_and_its_structure_buckles_to_both_sides(truss):
    """Below z^2 = h^2 - 2 a^2 it buckles to x^2 = h^2 - 2 a^2 - z^2, z the height of the crown."""
    structure, modes = truss
    load = structure.translation[[5]].toarray()[0]
    plain, buckled = (crown(structure, states) for states in _both_ways(structure, modes, load, DEFLECTION))
    np.testing.assert_allclose(plain[:, 0], 0.0, atol=1e-9)
    down, up = plain[plain[:, 1] < 0], plain[plain[:, 1] > 0]
    steps = np.arange(1, 13) / 12
    np.testing.assert_allclose(down[:, 1], -DEFLECTION * steps, rtol=1e-6)  # the softer way first
    assert np.array_equal(plain, np.vstack([down, up]))
    np.testing.assert_allclose(up[:, 1], DEFLECTION * steps[: len(up)], rtol=1e-6)
    most = energy(0.0, -DEFLECTION)
    assert energy(0.0, up[-1, 1]) > most and np.all(energy(0.0, up[:-1, 1]) <= most) and len(up) > 2
    half = len(buckled) // 2  # pushed to one side, then to the other
    assert half > 12
    np.testing.assert_allclose(buckled[:half] * [-1, 1], buckled[half:], rtol=1e-6, atol=1e-9)
    levels = np.append(np.abs(np.diff(buckled[:half, 1])) > 1e-9, True)  # the last of each stands, others fall to it
    x, z = np.abs(buckled[:half][levels]).T
    expected = np.sqrt(np.maximum(H**2 - 2 * A**2 - (H - z) ** 2, 0.0))
    far = expected > 0.3
    assert far.sum() >= 3
    np.testing.assert_allclose(x[far], expected[far], rtol=0.06)  # the push moves it by 2 %
    found = with_responses(structure, modes, 3, DEFLECTION, loads={"crown": ["z"]})
    reach = np.linalg.norm(np.vstack([plain, buckled]), axis=1).max()
    assert found.note == f"1 response shapes of {len(plain) + len(buckled)} states bent by up to {reach:.3g} m"
    assert found.kinds == ("vibration", "response")


def test_states_count_by_what_they_store_apart_from_the_work_of_the_initial_stress():
    """Energy x' K x / 2 + f0' x: each state counts 2 whatever its size, and so does the one that f0 pushes along."""
    K, f0 = np.diag([4.0, 9.0, 25.0]), np.array([0.0, 6.0, 0.0])
    structure = SimpleNamespace(
        K=K,
        M=np.eye(3),
        f0=f0,
        internal_force=SimpleNamespace(energy=lambda x: x @ K @ x / 2 + f0 @ x),
        mesh=SimpleNamespace(points=np.eye(3)),
        translation=np.eye(3),
        rotation=np.zeros((0, 3)),
    )
    states = np.array([[0.3, 0.0, 0.0], [0.0, 2.0, 0.0]])  # x' K x / 2 = f0' x = 18 of the second is 12 of f0
    none = np.zeros((3, 0))
    both = np.abs(_strongest(structure, none, states, 3, 0.9))  # the mean left by one of two is 1
    np.testing.assert_allclose(both, np.eye(3)[:, :2], atol=1e-12)
    assert _strongest(structure, none, states, 3, 1.1).shape == (3, 1)


def test_a_set_without_clamps_or_a_way_without_a_state_has_no_responses(truss, monkeypatch):
    structure, modes = truss
    beam = slender_beam(n=2, order=3)
    text = "responses are static states of a clamped structure, and this set is of a free one; drop them"
    with pytest.raises(ValueError, match=text):
        with_responses(beam, free_free_modes(beam, 1), 2, DEFLECTION)
    monkeypatch.setattr(load_path, "SMALLEST", 2.0)  # of a step: none is taken
    with pytest.raises(ValueError, match=r"no static state was found on the way to a deflection of 0\.123 m; lower it"):
        with_responses(structure, modes, 2, 0.1234, loads={"crown": ["z"]})


def test_without_loads_the_acceleration_that_moves_the_structure_most_is_answered(truss):
    """Along x the crown moves by its stiffness there, 2 EA a^2 / L^3; along z by that of its height."""
    structure, modes = truss
    found = with_responses(structure, modes.picked([]), 1, 0.05)
    assert np.abs(crown(structure, found.phi.T)) == pytest.approx(
        np.array([[np.linalg.norm(found.phi), 0.0]]), abs=1e-6
    )


def slope(x, z):
    """Forces (2,) on the crown moved by (x, z)."""
    out = np.zeros(2)
    for side in (1, -1):
        at = np.array([A * side + x, H + z])
        out += METAL.E * AREA * L * ((at @ at - L**2) / (2 * L**2)) * at / L**2
    return out


CLAMP = {"feet": ("x", "y", "z"), "crown": ("y",)}


@pytest.mark.parametrize(("fx", "fz"), [(2e4, -1e5), (3e5, 4e6), (1e3, -4e6), (-2e6, -3e6), (5e6, 1e6)])
def test_a_dead_load_moves_a_truss_to_where_its_bars_balance_it_and_it_stands(truss, fx, fz):
    """Where the load buckles it, it goes on to where its energy is least, an end of its way that is stable."""
    structure, _ = truss
    found = static_equilibrium(structure, CLAMP, Preload(forces={"crown": (fx, 0.0, fz)}))
    moved = found.mesh.points - structure.mesh.points
    assert not moved[[0, 2]].any() and moved[1, 1] == 0.0
    at = moved[1, [0, 2]]
    np.testing.assert_allclose(slope(*at), [fx, fz], atol=1e-8 * np.hypot(fx, fz))
    h = 1e-4 * np.eye(2)
    tangent = np.array([(slope(*(at + d)) - slope(*(at - d))) / 2e-4 for d in h])
    assert np.linalg.eigvalsh(tangent)[0] > 0.0
    assert energy(*at) - np.dot([fx, fz], at) < 0.0


@pytest.mark.parametrize("force", [3.0, -4e3, 5e6])
def test_two_bars_in_line_sag_by_the_cube_root_of_a_load_across_them(force):
    """EA (w / a)^3: they have no stiffness at first, so that no step is taken without a shift."""
    mesh = Mesh(
        np.array([[-A, 0, 0], [0, 0, 0], [A, 0, 0]]),
        {"line": np.array([[0, 1], [1, 2]])},
        {"legs": {"line": np.arange(2)}},
        {"feet": np.array([0, 2]), "crown": np.array([1])},
    )
    structure = build_structure(mesh, [Member("legs", "rod", Circle(0.01), METAL)])
    found = static_equilibrium(structure, CLAMP, Preload(forces={"crown": (0.0, 0.0, force)}))
    assert found.mesh.points[1] == pytest.approx([0.0, 0.0, A * np.cbrt(force / (METAL.E * AREA))], rel=1e-7, abs=1e-9)
    assert np.array_equal(found.mesh.points[[0, 2]], mesh.points[[0, 2]])
