"""What a lowest shape shortens a beam by, and which static shapes are worth a coordinate, by closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from support.reduction_examples import CLAMPED_FREE, EI_Y, EI_Z, LENGTH, MASS, slender_beam

from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    foreshortening,
    free_free_modes,
    nodal,
    reduce_structure,
    slow_loads,
    stretching,
    with_derivatives,
)
from femflex.reduction.beams.beam_functions import bending_characteristic
from femflex.reduction.large_deflection.stretch import Stretching, missing_stretch, relaxed_energy, require_stretch
from femflex.reduction.strain.tensors import strain_tensors

WAY = np.array([2.0, -1.0, 2.0]) / 3


def exact():
    """theta (k,) along the beam, points x and weights: -int w'^2 dx over the stiffness of the first bending shape."""
    g, v = np.polynomial.legendre.leggauss(40)
    g, v = (g + 1) / 2, v / 2
    first = bending_characteristic("clamped-free", 1)
    stiffness = EI_Y * (CLAMPED_FREE[0] / LENGTH) ** 4 * LENGTH  # of a shape of unit mean square

    def theta(x):
        xi = x / LENGTH
        slopes = first(np.outer(xi, g).ravel(), 1).reshape(len(x), 40) ** 2 / LENGTH**2
        return -x * (slopes @ v) / stiffness

    return theta, LENGTH * g, LENGTH * v


@pytest.mark.parametrize("made", ["modes", "nodal", "functions"])
def test_the_lowest_shape_shortens_a_beam_by_the_squares_of_its_slopes(made):
    """In skew axes; of nodal displacements the lowest combination counts, of functions the softer plane."""
    if made == "functions":
        beam = UniformBeam(LENGTH, 1e6, EI_Y, EI_Z, 100.0, MASS, direction=WAY)
        found, end = beam_body(beam, BeamFunctions(y=2, z=2)).foreshortening, "tip"
    else:
        structure = slender_beam(n=6, direction=WAY, order=4)
        modes = cantilever_modes(structure, "start", 3) if made == "modes" else nodal(structure, "start")
        found, end = foreshortening(structure, modes, {"nose": "end"}), "nose"
        assert set(found.at) == {"start", "nose"}
        assert not np.abs(found.at["start"]).max() > 1e-12
    theta, x, w = exact()
    rel = 2e-2 if made == "nodal" else 2e-3
    values = theta(x)[:, None] * WAY
    np.testing.assert_allclose(found.at[end], theta(np.array([LENGTH]))[0] * WAY, rtol=rel)
    np.testing.assert_allclose(found.mass[0], MASS * w @ values, rtol=rel)
    for a in range(3):
        np.testing.assert_allclose(found.mass[1 + a], MASS * (w * x * WAY[a]) @ values, rtol=rel)


def test_linear_bodies_know_how_they_shorten_and_free_ones_about_their_mean():
    structure = slender_beam(n=6, direction=WAY, order=4)
    body = reduce_structure(structure, cantilever_modes(structure, "start", 2), {"nose": "end"})
    direct = foreshortening(structure, cantilever_modes(structure, "start", 2), {"nose": "end"})
    np.testing.assert_allclose(body.foreshortening.mass, direct.mass, rtol=1e-6)
    free = foreshortening(structure, free_free_modes(structure, 2), {"one": "start", "other": "end"})
    np.testing.assert_allclose(free.mass[0], 0.0, atol=1e-6 * np.abs(free.mass).max())  # the mean stays
    np.testing.assert_allclose(free.at["one"], -free.at["other"], rtol=1e-5)
    assert free.at["one"] @ WAY > 0 > free.at["other"] @ WAY


def test_a_static_shape_is_worth_a_coordinate_by_the_share_of_the_work_that_modes_leave():
    """Of a tip force one mode leaves 1 - 12 / (beta L)^4 = 2.9 % of the work L^3 / 3 EI."""
    structure = slender_beam(n=6, order=4)
    modes = cantilever_modes(structure, "start", 1)
    left = 1 - 12.0 / CLAMPED_FREE[0] ** 4
    assert left == pytest.approx(0.029, abs=1e-3)
    for least, count in ((0.8 * left, 1), (1.2 * left, 0)):
        found = slow_loads(structure, modes, (), {"end": ["z"]}, least=least)
        assert found.shape == (structure.n_dof, count)
    both = slow_loads(structure, modes, (), {"end": ["y", "z"]}, least=1.2 * left)
    assert both.shape[1] == 1 and abs((structure.translation @ both)[-2, 0]) > 0  # no mode bends in the other plane


def test_a_set_is_sound_that_stores_at_most_a_tenth_of_its_bending_on_top():
    assert Stretching(0.1, 1.29, 1.2).sound and not Stretching(0.1, 1.31, 1.2).sound
    structure = slender_beam(n=2, order=3)
    modes = cantilever_modes(structure, "start", 2)
    tensors = strain_tensors(structure, modes.phi)
    found = stretching(structure, modes, tensors, 0.02)
    assert found.deflection == pytest.approx(0.02 * LENGTH) and found.relaxed == pytest.approx(1.0, abs=2e-2)
    phi = modes.phi[:, 0]
    amount = 0.02 * LENGTH / np.linalg.norm((structure.translation @ phi).reshape(-1, 3), axis=1).max()
    best = min(tensors.energy(np.array([amount, q])) for q in np.linspace(-0.2, 0.2, 401) * amount)
    assert relaxed_energy(tensors, 0, amount) <= best * (1 + 1e-9)
    assert relaxed_energy(tensors, 0, amount) == pytest.approx(best, rel=5e-3)
    assert found.alone == pytest.approx(best / (tensors.V1[0, 0] * amount**2 / 2), rel=5e-3)
    text = missing_stretch(structure, modes, tensors)
    assert text.startswith("2 shapes (vibration) cannot stretch: with nonlinear strain the lowest one, bent by 0.05 m")
    with pytest.raises(ValueError, match=r"Add static derivatives \(derivatives = 'auto'\), or take the set as it is"):
        require_stretch(structure, modes, tensors)
    whole = with_derivatives(structure, modes)
    assert missing_stretch(structure, whole, strain_tensors(structure, whole.phi)) == ""
