"""Modal derivatives: the bent strip, the definition by differences, supports, and what is kept of them."""

from __future__ import annotations

import numpy as np
import pytest
from support.nonlinear_models import METAL
from support.reduction_examples import slender_beam

from femflex.fem import Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh import box, line, rectangle
from femflex.reduction import (
    cantilever_modes,
    craig_bampton,
    free_free_modes,
    reduce_structure,
    require_stretch,
    strain_tensors,
    stretching,
    with_attachment,
    with_derivatives,
)
from femflex.reduction.boundary.rigid import rigid_shapes
from femflex.reduction.large_deflection.derivatives import load_weights, number_kept, scaled_derivatives
from femflex.reduction.large_deflection.stretch import relaxed_energy

# a strip's bending in its own plane, which nothing excites here, is warned of
pytestmark = pytest.mark.filterwarnings("ignore:plates turn in their own planes")
LENGTH, THICKNESS = 1.0, 0.01


def beam(order=6, n=4):
    section = Rectangle(0.05, THICKNESS)
    mesh = line([[0, 0, 0], [LENGTH, 0, 0]], n)
    options = {"order": order, "orientation": (0, 1, 0), "rotary_inertia": False}
    return build_structure(mesh, [Member("line", "beam", section, METAL, options)])


def plate():
    mesh = rectangle(LENGTH, 0.05, 20, 1, "triangle")
    return build_structure(mesh, [Member("surface", "plate", THICKNESS, METAL)])


def solid():
    mesh = box(LENGTH, 0.05, THICKNESS, 20, 1, 1, "hexahedron27")
    return build_structure(mesh, [Member("volume", "solid", None, METAL)])


def ratios(structure, modes, deflection):
    """Energy over linear energy with the lowest shape alone, and with all others of the set relaxed."""
    tensors = strain_tensors(structure, modes.phi)
    amount = deflection / np.abs(structure.translation @ modes.phi[:, 0]).max()
    linear = tensors.V1[0, 0] * amount**2 / 2
    alone = tensors.energy(amount * np.eye(modes.n_modes)[0])
    return alone / linear, relaxed_energy(tensors, 0, amount) / linear


def test_one_bending_mode_alone_stores_far_too_much_and_derivatives_take_it_back():
    """eps = w'^2 / 2 is not relaxed: 1 + (a / h)^2 3 int w'^4 / int w''^2 with the clamped-free function w of unit tip.

    A strip of length 100 h: 2.75 at 1 % of its length and 175.7 at 10 %.
    """
    structure = beam()
    full = with_derivatives(structure, cantilever_modes(structure, "start", 1))
    assert full.kinds == ("vibration", "derivative")
    k, s = 1.8751040687119611, 0.7340955137589128  # beta L, and the ratio of the function's two parts
    x = np.linspace(0, 1, 20001)
    slope = k * (np.sinh(k * x) + np.sin(k * x) - s * (np.cosh(k * x) - np.cos(k * x))) / 2
    bend = k**2 * (np.cosh(k * x) + np.cos(k * x) - s * (np.sinh(k * x) + np.sin(k * x))) / 2
    factor = 3 * np.trapezoid(slope**4, x) / np.trapezoid(bend**2, x)
    assert factor == pytest.approx(1.747, abs=1e-3)
    curved = np.trapezoid((slope * bend) ** 2, x) / np.trapezoid(bend**2, x)  # kappa^2 = w''^2 (1 + w'^2)
    for deflection in (0.01, 0.1):
        alone, relaxed = ratios(structure, full, deflection)
        assert alone == pytest.approx(1 + factor * (deflection / THICKNESS) ** 2, rel=2e-5)
        assert relaxed == pytest.approx(1 + curved * deflection**2, abs=0.002 * deflection)


@pytest.mark.parametrize("make", [plate, solid])
def test_derivatives_relax_plates_and_solids_too(make):
    structure = make()
    full = with_derivatives(structure, cantilever_modes(structure, "left", 1))
    for deflection, bound in ((0.01, 5e-5), (0.1, 5e-3)):
        alone, relaxed = ratios(structure, full, deflection)
        assert alone > 2.7 * (deflection / 0.01) ** 2 / 2
        assert 0 < relaxed - 1 < bound


def test_a_derivative_is_the_static_answer_to_the_change_of_the_tangent():
    structure = solid()
    modes = cantilever_modes(structure, "left", 2)
    theta = scaled_derivatives(structure, modes)
    phi = modes.phi / modes.omega
    elastic, h = structure.internal_force, 1e-2
    change = (elastic.tangent(h * phi[:, 1]) - elastic.tangent(-h * phi[:, 1])) / (2 * h)
    for column, i in ((1, 0), (2, 1)):  # pairs 00, 01, 11
        residual = structure.K @ theta[:, column] + change @ phi[:, i]
        residual[modes.held] = 0.0
        assert np.abs(residual).max() < 1e-7 * np.abs(change @ phi[:, i]).max()
    assert not theta[modes.held].any()


SETS = {
    "cantilever": lambda s: cantilever_modes(s, "left", 3),
    "with attachment": lambda s: with_attachment(s, cantilever_modes(s, "left", 2), ["x", "rz"], {"right": ["z"]}),
    "free-free": lambda s: free_free_modes(s, 3),
    "two interfaces": lambda s: craig_bampton(s, ["left", "right"], 1),
    "clamped and interface": lambda s: craig_bampton(s, ["right"], 1, "left"),
}


@pytest.mark.parametrize("name", SETS)
def test_every_kind_of_set_stays_orthonormal_in_its_frame_and_can_stretch(name):
    structure = plate()
    modes = SETS[name](structure)
    full = with_derivatives(structure, modes)
    n = modes.n_modes
    np.testing.assert_array_equal(full.phi[:, :n], modes.phi)
    assert set(full.kinds[n:]) == {"derivative"} and full.n_modes > n
    np.testing.assert_allclose(full.phi.T @ (structure.M @ full.phi), np.eye(full.n_modes), atol=1e-9)
    if name == "free-free":
        R = rigid_shapes(structure)
        assert np.abs(R.T @ (structure.M @ full.phi)).max() < 1e-6 * np.sqrt(np.diag(R.T @ (structure.M @ R))).max()
    else:
        left = (3 * structure.mesh.group_points("left")[:, None] + np.arange(3)).ravel()
        moved = structure.translation @ full.phi
        assert np.abs(moved[left].reshape(-1, 3, full.n_modes).mean(axis=0)).max() < 1e-9 * np.abs(moved).max()
    before = stretching(structure, modes, strain_tensors(structure, modes.phi))
    after = stretching(structure, full, reduce_structure(structure, full, strain="nonlinear").strain)
    assert not before.sound and after.sound
    slight = stretching(structure, full, strain_tensors(structure, full.phi), 1e-4)  # what linear strain relaxes
    assert after.alone - slight.alone == pytest.approx(after.relaxed - slight.relaxed, abs=5e-5)


def test_as_many_derivatives_are_kept_as_asked_the_most_energetic_first():
    structure = plate()
    modes = cantilever_modes(structure, "left", 4)
    few, auto, every = (with_derivatives(structure, modes, keep) for keep in (2, "auto", "all"))
    assert [few.n_modes, every.n_modes - 4] == [6, 9]
    assert few.n_modes < auto.n_modes <= every.n_modes
    assert few.note.startswith("2 derivative shapes for 10 pairs, ")
    left = [float(found.note.split(", ")[1].split()[0]) for found in (few, auto, every)]
    assert left[0] > left[1] >= left[2] and left[1] < 1e-6
    assert np.all(np.diff(every.omega[4:]) >= 0)


def test_combinations_that_add_nothing_are_never_kept():
    energy = np.array([2.0, 1.0, 1e-3, 1e-8, 1e-15, 0.0])
    assert [number_kept(energy, keep, 1e-6 * energy.sum()) for keep in (0, 2, 9, "all", "auto")] == [0, 2, 4, 4, 3]
    assert number_kept(np.zeros(3), "auto", 0.0) == number_kept(np.zeros(0), "all", 0.0) == 0
    with pytest.raises(ValueError, match="derivative shapes to keep is 'some'; give a number, 'auto' or 'all'"):
        number_kept(energy, "some", 0.0)


def test_modes_along_a_straight_line_share_their_derivatives():
    """Bending in one plane and in the other stretch the same line: the pairs are dependent and found to be."""
    mesh = line([[0, 0, 0], [LENGTH, 0, 0]], 4)
    structure = build_structure(mesh, [Member("line", "beam", Rectangle(0.02, 0.02), METAL, {"order": 4})])
    full = with_derivatives(structure, cantilever_modes(structure, "start", 2), "all")
    assert "3 pairs" in full.note and full.kinds.count("derivative") == 1


def test_a_set_that_cannot_stretch_is_refused_with_both_numbers():
    structure = beam()
    modes = cantilever_modes(structure, "start", 2)
    text = r"2 shapes \(vibration\) cannot stretch: .* stores 2.75 times .* stores 1 times that energy. Add static"
    with pytest.raises(ValueError, match=text):
        require_stretch(structure, modes, strain_tensors(structure, modes.phi))


def test_a_set_with_too_few_derivatives_is_told_how_many_it_has():
    structure = beam()
    full = with_derivatives(structure, cantilever_modes(structure, "start", 2), "all")
    assert full.kinds.count("derivative") == 3
    few = full.picked([0, 1, 4])  # the stiffest of them does little for the lowest mode
    with pytest.raises(ValueError, match=r"cannot stretch: .* Its one static derivative is too few: keep more of them"):
        require_stretch(structure, few, strain_tensors(structure, few.phi))
    require_stretch(structure, full, strain_tensors(structure, full.phi))


@pytest.mark.parametrize(("rises", "turning"), [(0.6, ()), (2.0, ("ry",))])
def test_an_arch_bent_beyond_its_rise_relaxes_at_least_as_far_with_more_shapes(rises, turning):
    """All derivatives hold the lowest shape's own: the least energy over them cannot lie above that over it alone."""
    height, held = 0.008, ("x", "y", "z", "rx", "rz", *turning)
    mesh = line(lambda s: [1.3 * s, 0, 4 * rises * height * s * (1 - s)], 16)
    member = Member("line", "beam", Rectangle(0.02, height), METAL, {"orientation": (0, 1, 0)})
    structure = build_structure(mesh, [member])
    modes = with_derivatives(structure, cantilever_modes(structure, {"start": held, "end": held}, 4), "all")
    tensors = strain_tensors(structure, modes.phi)
    found = stretching(structure, modes, tensors)
    assert found.alone <= found.relaxed * (1 + 1e-6)
    require_stretch(structure, modes, tensors)


def test_a_pair_of_two_shapes_counts_for_both_orders_of_them():
    """q_i q_j of equal loads, 1 / omega^2 each in units of equal energy: sums of squares over all i and j agree."""
    structure = slender_beam()
    modes = cantilever_modes(structure, "start", 3)
    q = modes.omega[0] / modes.omega
    i, j = np.triu_indices(3)
    value = np.random.default_rng(0).uniform(size=(3, 3))
    value = value + value.T
    assert np.sum(load_weights(structure, modes) ** 2 * value[i, j]) == pytest.approx(
        np.sum(np.outer(q, q) ** 2 * value)
    )
