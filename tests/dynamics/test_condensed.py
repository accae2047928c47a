"""Condensed bodies: loops, rotating beams, and dependent derivative shapes against independent ones."""

from dataclasses import replace

import numpy as np
import pytest
from support.mechanisms import four_bar
from support.rotating_beams import Rotating

from femflex import fem
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.linear.equations import linearised
from femflex.mesh import line
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    with_derivatives,
)
from femflex.system import Frame, System, weld


def test_loop_of_condensed_beams_conserves_energy():
    rigid = four_bar(speed=3.0)
    bodies = dict(rigid.bodies)
    for name, length in (("crank", 0.5), ("coupler", 2.0), ("rocker", 1.2)):
        beam = UniformBeam(length, 1e5, 1.0, 1.0, 1.0, 1.0)
        body = beam_body(beam, BeamFunctions(y=2, family="polynomial"), strain="condensed")
        bodies[name] = replace(body, markers={**body.markers, "end": body.markers["tip"]})
    model = compile_system(replace(rigid, bodies=bodies))
    times = np.linspace(0, 2, 41)
    states = integrator("dop853", rtol=1e-10, atol=1e-10).solve(model, times, model.x0).states
    seen = model.observe(times, states)
    bent = np.abs(seen["markers/coupler.end/deflection"][:, 1]).max()
    assert bent > 0.02  # of a bar of 2 m
    assert np.ptp(seen["monitors/energy"]) < 1e-7 * seen["monitors/energy"][0]
    apart = seen["markers/coupler.end/position"] - seen["markers/rocker.end/position"]
    assert np.abs(apart).max() < 1e-8


def beam(modes, strain, elements=12):
    """A meshed beam of unit length, mass and bending stiffness in the plane of rotation, 1.9 of it in lag."""
    section = fem.sections.StiffnessSection(1e6, 1.0, 1.9, 0.7, 1.0, ry=1e-3, rz=1e-3)
    structure = fem.build_structure(line([[0, 0, 0], [1.0, 0, 0]], elements), [fem.Member("line", "beam", section)])
    found = with_derivatives(structure, cantilever_modes(structure, "start", modes), "all")
    return reduce_structure(structure, found, {"tip": "end"}, strain=strain)


def test_meshed_rotating_beam_frequencies_converge():
    exact = Rotating(4.0, lag=1.9)
    frame = Frame("spinning", np.array([0.0, 0.0, 4.0]))
    model = compile_system(System({"beam": beam(10, "condensed")}, (weld("beam"),), frame=frame))
    assert model.n_q == 10
    found = linearised(model, 0.0, np.zeros(model.n_x)).eigenvalues().imag
    found = np.sort(found[found > 0])[:4]
    assert found == pytest.approx(exact.exact(found), rel=3e-5)  # cubic elements


def shortening():
    """1/2 int w'^2 dx of the first mode of a clamped-free beam of unit length, w = 1 at its tip."""
    x, weight = np.polynomial.legendre.leggauss(40)
    s, beta = (x + 1) / 2, 1.8751040687119611
    ratio = (np.cosh(beta) + np.cos(beta)) / (np.sinh(beta) + np.sin(beta))
    slope = beta * (np.sinh(beta * s) + np.sin(beta * s) - ratio * (np.cosh(beta * s) - np.cos(beta * s))) / 2
    return weight @ slope**2 / 4


def swing(strain, size):
    """Tip deflections of a beam let go with a bend of that size in both planes, in a frame that spins askew."""
    body = beam(4, strain, elements=6)
    delta = np.zeros(body.n_modes)
    delta[:2] = 0.5 * size, 0.4 * size
    for _ in range(10 if strain == "nonlinear" else 0):  # the stretch that belongs to the bend
        others = np.arange(4, body.n_modes)
        stretch = np.linalg.solve(body.strain.tangent(delta)[4:, 4:], body.strain.force(delta)[others])
        delta[others] -= stretch
    frame, times = Frame("spinning", np.array([0.0, 0.5, 2.0])), np.linspace(0, 3, 61)
    model = compile_system(System({"beam": body}, (weld("beam"),), frame=frame, delta0={"beam": delta}))
    states = integrator("dop853", rtol=1e-8, atol=1e-10).solve(model, times, model.x0).states
    return model.observe(times, states)["markers/beam.tip/deflection"]


@pytest.mark.slow
def test_dependent_and_independent_derivatives_agree():
    apart = []
    for size in (0.08, 0.04):
        tips = [swing(strain, size) for strain in ("condensed", "nonlinear")]
        for tip in tips:  # modes of mass 1 of a cantilever of mass 1 are 2 at its tip
            assert np.sort(np.abs(tip[0, 1:])) == pytest.approx([0.8 * size, size], rel=1e-3)
            assert -tip[0, 0] == pytest.approx(shortening() * 1.64 * size**2, rel=0.02)
        apart.append(np.abs(tips[0] - tips[1]).max() / size)
    assert apart[0] < 8e-3
    assert np.log2(apart[0] / apart[1]) > 1.7  # what the two leave out is of third order in the bend
