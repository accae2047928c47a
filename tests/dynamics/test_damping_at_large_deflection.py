"""Damping of bodies that bend far: bending decays as its own fraction says, whatever form the stretch has."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.dynamics import compile_system
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.integrate import integrator
from femflex.mesh import line
from femflex.reduction import (
    BeamFunctions,
    ModalDamping,
    RayleighDamping,
    UniformBeam,
    beam_body,
    bending_damping,
    cantilever_modes,
    reduce_structure,
    with_derivatives,
)
from femflex.system import System, weld

ZETA = 0.01
TIMES = np.linspace(0.0, 8.0, 401)


def meshed(strain):
    """A strip of 2 m, 1.6 Hz, two modes of bending."""
    section, metal = Rectangle(0.05, 0.008), Material(70e9, 0.3, 2700.0)
    mesh = line([[0, 0, 0], [2.0, 0, 0]], 4)
    options = {"order": 4, "orientation": (0, 1, 0)}
    structure = build_structure(mesh, [Member("line", "beam", section, metal, options)])
    modes = with_derivatives(structure, cantilever_modes(structure, "start", 1))
    return reduce_structure(structure, modes, {"tip": "end", "root": "start"}, ModalDamping(ZETA), strain)


def analytic(strain):
    """A beam of 2 m on polynomials, one coordinate of bending."""
    beam = UniformBeam(2.0, 2.8e7, 149.0, 149.0, 100.0, 1.08)
    functions = BeamFunctions(y=1, axial=9 if strain == "nonlinear" else 0, family="polynomial")
    return beam_body(beam, functions, ModalDamping(ZETA), strain=strain)


def energy_left(body):
    """Energy of a body (n_t,) over that at the start, where it is let go bent by a tenth of its length."""
    delta = np.zeros(body.n_modes)
    delta[0] = 0.2 / np.linalg.norm(body.markers["tip"].phi[:, 0])
    if not len(body.slaves):  # begin with the stretch taken back, as a body bent slowly would
        for _ in range(20):
            rest = np.arange(1, body.n_modes)
            delta[rest] -= np.linalg.solve(
                body.strain.tangent(delta)[np.ix_(rest, rest)], body.strain.force(delta)[rest]
            )
    system = System({"beam": body}, (weld("beam", child_marker="root"),), delta0={"beam": delta})
    model = compile_system(system)
    states = integrator("dop853", rtol=1e-8, atol=1e-10).solve(model, TIMES, model.x0).states
    energy = model.observe(TIMES, states)["monitors/energy"]
    return energy / energy[0]


@pytest.mark.slow
@pytest.mark.parametrize("make", [meshed, analytic])
def test_stretch_with_coordinates_of_its_own_damps_bending_no_more_than_stretch_that_follows(make):
    """Energy falls as exp(-2 zeta omega t), within what the bend does to the frequency."""
    nonlinear, condensed = energy_left(make("nonlinear")), energy_left(make("condensed"))
    np.testing.assert_allclose(nonlinear, condensed, rtol=0.02)
    assert condensed[-1] == pytest.approx(np.exp(-2 * ZETA * make("condensed").omega[0] * TIMES[-1]), rel=0.05)


@pytest.mark.parametrize("damping", [ModalDamping(0.02), RayleighDamping(0.1, 1e-3)])
def test_shapes_left_out_of_the_damping_have_none_and_the_others_their_own(damping):
    rng = np.random.default_rng(3)
    Me, V1 = (x @ x.T + np.eye(5) for x in rng.normal(size=(2, 5, 5)))
    D = bending_damping(damping, Me, V1, [True, False, True, True, False])
    assert not D[[1, 4]].any() and not D[:, [1, 4]].any()
    at = np.ix_([0, 2, 3], [0, 2, 3])
    np.testing.assert_allclose(D[at], damping.matrix(Me[at], V1[at]))


def test_with_linear_strain_derivatives_are_shapes_like_others_and_damped():
    linear, nonlinear = meshed("linear"), meshed("nonlinear")
    led = np.array([kind == "derivative" for kind in linear.kinds])
    assert np.all(np.diag(linear.damping) > 0)
    assert np.all(np.diag(nonlinear.damping)[led] == 0) and np.all(np.diag(nonlinear.damping)[~led] > 0)
