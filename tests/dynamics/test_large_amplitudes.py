"""Large amplitudes: backbone of a pinned beam, elastica, bending in two planes with torsion, Duffing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import ellipk
from support.elastica import EI, LENGTH, SECTION, elastica

from femflex import equilibrium, fem, reduction, system
from femflex.dynamics import compile_system
from femflex.dynamics.ledger.without import linearised_body
from femflex.dynamics.observe.markers import marker_motion
from femflex.integrate import integrator
from femflex.mesh import line
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    with_attachment,
    with_derivatives,
)
from femflex.system import Load, System, weld

RADIUS, SPAN = 1e-4, 1.0  # of gyration and of the beam: so slender that stretching moves next to no mass
EA = 1e6


def swinging(strain, axial):
    """A beam whose unit amplitude of the first coordinate is sqrt(2) sin(pi x / L)."""
    EI = EA * RADIUS**2
    beam = UniformBeam(SPAN, EA, EI, EI, EI, 1.0)
    functions = BeamFunctions(y=1, axial=axial, ends="pinned-pinned")
    return beam_body(beam, functions, strain=strain)


@pytest.mark.parametrize("strain, axial", [("condensed", 0), ("nonlinear", 2)])
@pytest.mark.parametrize("ratio, published", [(1, 1.0892), (2, 1.3178), (3, 1.6257)])
def test_pinned_beam_backbone_curve(strain, axial, ratio, published):
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


def tip(elements, ratio, way=(0.0, 0.0, 1.0), **options):
    """Deflection (3,) over the length, of a condensed cantilever under a dead tip load P L^2 / EI that way."""
    member = fem.Member("line", "beam", SECTION, None, options)
    structure = fem.build_structure(line([[0, 0, 0], [LENGTH, 0, 0]], elements), [member])
    modes = with_attachment(structure, cantilever_modes(structure, "start", 4), (), {"end": ["y", "z"]})
    modes = with_derivatives(structure, modes, "all")
    body = reduce_structure(structure, modes, {"root": "start", "tip": "end"}, strain="condensed")
    load = Load("pull", "beam", "tip", frame="inertial", force=ratio * EI / LENGTH**2 * np.array(way))
    state = equilibrium(System({"beam": body}, (weld("beam", None, child_marker="root"),), (load,)))
    return body.markers["tip"].phi @ body.amplitudes(state.q) / LENGTH


@pytest.mark.parametrize("ratio", [0.1, 0.2, 0.3, 0.5])
def test_deflection_error_is_fourth_order_in_elastica(ratio):
    """L/r = 4472. Curvature is that of an axis that keeps its length, to third order; locking took 40 % at a sixth.

    The tip draws in by int w'^2 / 2, which lacks w'^4 / 8.
    """
    w, u = elastica(ratio)
    found = tip(8, ratio)
    assert found[2] == pytest.approx(w, rel=2.0 * w**4 + 1e-5)
    assert -found[0] == pytest.approx(u, rel=0.5 * w**2 + 1e-4)


LENGTH_OF_BIAXIAL_BENDING, EI_OF_BIAXIAL_BENDING, TIMES_OF_BIAXIAL_BENDING = 10.0, 1.4e4, np.linspace(0, 2, 41)
SECTION_OF_BIAXIAL_BENDING = fem.sections.StiffnessSection(
    2.8e7, 5 * EI_OF_BIAXIAL_BENDING, EI_OF_BIAXIAL_BENDING, 4e3, 1.2, ry=0.0224, rz=0.0224
)
MEMBERS = [fem.Member("line", "beam", SECTION_OF_BIAXIAL_BENDING, None, {"orientation": (0, 1, 0)})]
MARKERS = {"tip": "end", "root": "start"}


def mesh(elements):
    return line([[0, 0, 0], [LENGTH_OF_BIAXIAL_BENDING, 0, 0]], elements)


def single_body():
    structure = fem.build_structure(mesh(8), MEMBERS)
    shapes = reduction.with_derivatives(structure, reduction.cantilever_modes(structure, "start", 8), "all")
    return reduction.reduce_structure(structure, shapes, MARKERS, strain="condensed")


def segmented(k):
    return system.Segments(reduction.reduce_segments(fem.cut_into_segments(mesh(12), MEMBERS, k), MARKERS))


FORCE = np.array([0.0, 40.0, -200.0])  # dead, skew to both planes


def loaded_motion(body, share, build=System, method="dop853", rtol=1e-7):
    """Model and states after the load has come upon the tip at t = 0."""
    load = Load("P", "beam", "tip", frame="inertial", force=share * FORCE)
    model = compile_system(build({"beam": body}, (weld("beam", None, child_marker="root"),), (load,)))
    return model, integrator(method, rtol=rtol, atol=rtol).solve(model, TIMES_OF_BIAXIAL_BENDING, model.x0).states


def tip_of_biaxial_bending(model, states):
    """Place of the tip (n_t, 3) and its twist (n_t,): what is left of its turn beyond the shortest to its tangent."""
    seen = model.observe(TIMES_OF_BIAXIAL_BENDING, states)
    C = marker_motion(model.system, TIMES_OF_BIAXIAL_BENDING, seen, model.system.order[-1], "tip")[1]
    twist = []
    for turn in C:
        bend = Rotation.from_rotvec(shortest(turn[:, 0])).as_matrix().T @ turn
        twist.append(np.arctan2(bend[2, 1], bend[1, 1]))
    return seen["markers/beam.tip/position"], np.array(twist)


def shortest(tangent):
    """Rotation vector of the shortest turn of x into that unit vector."""
    axis = np.cross([1.0, 0, 0], tangent)
    return axis * np.arctan2(np.linalg.norm(axis), tangent[0]) / max(np.linalg.norm(axis), 1e-300)


def test_biaxial_bending_energy_balances_work():
    model, states = loaded_motion(single_body(), 0.4)
    seen = model.observe(TIMES_OF_BIAXIAL_BENDING, states)
    way = seen["markers/beam.tip/position"]
    work = (way - way[0]) @ (0.4 * FORCE)
    energy = seen["monitors/kinetic"] + seen["monitors/elastic"]
    assert np.abs(energy - energy[0] - work).max() < 1e-6 * work.max()
    assert (
        np.ptp(way, axis=0).min() > 0.005 * LENGTH_OF_BIAXIAL_BENDING
        and np.abs(tip_of_biaxial_bending(model, states)[1]).max() > 0.03
    )  # all ways
    linear = compile_system(replace(model.system, bodies={"beam": linearised_body(single_body())})).observe(
        TIMES_OF_BIAXIAL_BENDING, states
    )
    wrong = linear["monitors/kinetic"] + linear["monitors/elastic"]
    assert np.abs(wrong - wrong[0] - work).max() > 1e-3 * work.max()  # the balance sees what is not linear


@pytest.mark.slow
def test_biaxial_bending_matches_segments():
    """Place over the largest motion, x and then y, z, and twist over the largest twist; and with linear strain."""
    own, other, coarse = [], [], []
    for share in (0.4, 0.2):
        six, twelve = (
            tip_of_biaxial_bending(*loaded_motion(segmented(k), share, system.assembled, "esdirk4", 1e-6))
            for k in (6, 12)
        )
        exact = [b + (b - a) / 3 for a, b in zip(six, twelve, strict=True)]
        sizes = np.ptp(exact[0], axis=0).max(), np.abs(exact[1]).max()
        for kept, found in (
            (own, tip_of_biaxial_bending(*loaded_motion(single_body(), share))),
            (other, tip_of_biaxial_bending(*loaded_motion(linearised_body(single_body()), share))),
            (coarse, twelve),
        ):
            place = np.abs(found[0] - exact[0]).max(axis=0) / sizes[0]
            kept.append([place[0], place[1:].max(), np.abs(found[1] - exact[1]).max() / sizes[1]])
    own, other, coarse = np.array(own), np.array(other), np.array(coarse)
    assert (own < [[0.001, 0.005, 0.16], [5e-4, 0.002, 0.1]]).all()  # bent by 8 % of the length
    assert other[0, 0] > 0.06 and other[:, 2] == pytest.approx([1.0, 1.0])  # linear strain: no shortening, no twist
    assert (coarse[:, :2] < 1e-3).all() and (coarse[:, 2] < 0.06).all()  # what it is judged by


def test_duffing_period_matches_elliptic_integral():
    from scipy.special import ellipk

    from femflex.body import FlexibleBody, MassMoments, StrainTensors
    from femflex.system import System, weld

    k, cubic, a = 4.0, 3.0, 1.7  # x'' + k x + cubic x^3 = 0
    moments = MassMoments(1.0, np.array([[0, 0, 0], [1.0, 0, 0]]), np.zeros((2, 3, 2, 3)))
    moments.second[1, 0, 1, 0] = 1.0
    strain = StrainTensors(np.array([[k]]), np.zeros(1), np.zeros(1), np.array([cubic / 2]))
    body = FlexibleBody(moments, strain, np.zeros((1, 1)), {})
    model = compile_system(System({"beam": body}, (weld("beam"),), delta0={"beam": np.array([a])}))
    omega = np.sqrt(k + cubic * a**2)
    period = 4 / omega * ellipk(cubic * a**2 / (2 * omega**2))
    end = integrator("dop853", rtol=1e-12, atol=1e-12).solve(model, np.array([0.0, period]), model.x0).states[-1]
    assert end == pytest.approx([a, 0.0], abs=1e-9)
    assert model.max_frequency == pytest.approx(np.sqrt(k + 3 * cubic * a**2), rel=1e-5)
