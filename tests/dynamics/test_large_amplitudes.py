"""Row G2: a simply supported beam with immovable ends swings faster the further it swings (Woinowsky-Krieger 1950)."""

import numpy as np
import pytest
from scipy.special import ellipk

from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import System, weld

RADIUS, LENGTH = 1e-4, 1.0  # of gyration and of the beam: so slender that stretching moves next to no mass
EA = 1e6


def swinging(strain, axial):
    """A beam whose unit amplitude of the first coordinate is sqrt(2) sin(pi x / L)."""
    EI = EA * RADIUS**2
    beam = UniformBeam(LENGTH, EA, EI, EI, EI, 1.0)
    functions = BeamFunctions(y=1, axial=axial, ends="pinned-pinned")
    return beam_body(beam, functions, strain=strain)


@pytest.mark.parametrize("strain, axial", [("condensed", 0), ("nonlinear", 2)])
@pytest.mark.parametrize("ratio, published", [(1, 1.0892), (2, 1.3178), (3, 1.6257)])
def test_frequency_of_a_held_beam_grows_with_its_amplitude(strain, axial, ratio, published):
    body = swinging(strain, axial)
    omega = body.omega[0]
    a, c = ratio * RADIUS, 1 / (4 * RADIUS**2)  # q'' + omega^2 (q + c q^3) = 0
    fast = omega * np.sqrt(1 + c * a**2)
    quarter = ellipk(c * a**2 / (2 * (1 + c * a**2))) / fast
    exact = np.pi / 2 / quarter / omega
    assert exact == pytest.approx(published, abs=6e-5)
    delta = np.zeros(body.n_modes)
    delta[0] = a / np.sqrt(2)
    if strain == "nonlinear":  # begin with the stretch that belongs to the bend
        d = body.strain
        for _ in range(20):
            others = np.arange(1, len(delta))
            step = np.linalg.solve(d.tangent(delta)[np.ix_(others, others)], d.force(delta)[others])
            delta[others] -= step
    model = compile_system(System({"beam": body}, (weld("beam"),), delta0={"beam": delta}))
    times = quarter * np.array([0.0, 0.9, 1.0, 1.1])
    states = integrator("dop853", rtol=1e-11, atol=1e-16).solve(model, times, model.x0).states
    q, u = states[2, 0], states[2, model.n_q]
    late = quarter - q / u  # when it passes the middle
    assert np.pi / 2 / late / omega == pytest.approx(exact, rel=1e-6)
