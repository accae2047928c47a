"""Uniform gravity on the ground: material points, pendulums, sagging and standing beams, chains, and free fall."""

import numpy as np
import pytest
from scipy.special import ellipk, jn_zeros
from support.pointwise import Tree, equations
from support.random_systems import random_tree
from support.random_table import DependentTree, at_rest, elastic_forces, random_condensed

from femflex import fem
from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.linear.equilibrium import equilibrium
from femflex.mesh import line
from femflex.reduction import BeamFunctions, UniformBeam, beam_body, cantilever_modes, reduce_structure, with_attachment
from femflex.system import Environment, System, free, revolute, weld

G = 9.81
DOWN = Environment(np.array([0.0, 0.0, -G]))
ASKEW = Environment(np.array([2.0, -3.0, 5.0]))


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("condensed", [False, True])
def test_weight_of_material_points(seed, condensed):
    found = random_condensed(seed, environment=ASKEW) if condensed else random_tree(seed, environment=ASKEW)
    system, clouds, (q, u) = found
    tree = DependentTree(system, clouds) if condensed else Tree(system, clouds)
    model = compile_system(system)
    udot = np.random.default_rng(seed).normal(size=model.n_u)
    ours = model.residual(0.0, np.concatenate([q, u]), udot)
    theirs = equations(tree, q, u, udot, at_rest, lambda m, r: m[:, None] * ASKEW.gravity)
    theirs = theirs + elastic_forces(system, q, u)
    assert ours == pytest.approx(theirs, rel=1e-10, abs=1e-10 * np.abs(theirs).max(initial=1))


@pytest.mark.parametrize("amplitude, own", [(0.1, 0.3), (2.0, 0.3), (3.1, 0.3), (2.0, 0.0)])  # the last: a point mass
def test_pendulum_period_matches_elliptic_integral(amplitude, own):
    mass, arm = 2.0, 0.7
    body = rigid_body(mass, np.eye(3) * own if own else None, center_of_mass=np.array([0, 0, -arm]))
    inertia = own + mass * arm**2  # about the pivot
    start = revolute("rod", axis=[0, 1, 0], q0=[amplitude])
    model = compile_system(System({"rod": body}, (start,), environment=DOWN))
    quarter = np.sqrt(inertia / (mass * G * arm)) * ellipk(np.sin(amplitude / 2) ** 2)
    times = quarter * np.array([0.0, 1.0, 2.0, 4.0])
    states = integrator("dop853", rtol=1e-12).solve(model, times, model.x0).states
    assert states[:, 0] == pytest.approx([amplitude, 0.0, -amplitude, amplitude], abs=1e-9)
    assert states[1, 1] == pytest.approx(-2 * np.sqrt(mass * G * arm / inertia) * np.sin(amplitude / 2), rel=1e-9)


EI, RHO_A, LENGTH = 5000.0, 4.0, 3.0


def slender(strain, axial=4, bending=6, stiffness=EI):
    beam = UniformBeam(LENGTH, 1e8, stiffness, stiffness, stiffness, RHO_A, rotary_inertia=False)
    functions = BeamFunctions(y=0, z=bending, axial=axial if strain == "nonlinear" else 0, family="polynomial")
    return beam_body(beam, functions, strain=strain)


@pytest.mark.parametrize("strain", ["linear", "nonlinear", "condensed"])
def test_cantilever_sag_matches_closed_form(strain):
    tiny = 1e-3  # of the earth's gravity: bends so little that all strains agree
    system = System({"beam": slender(strain)}, (weld("beam"),), environment=Environment(tiny * DOWN.gravity))
    found = equilibrium(system)
    sag = found.model.observe(np.zeros(1), found.x[None])["markers/beam.tip/deflection"][0, 2]
    assert sag == pytest.approx(-RHO_A * tiny * G * LENGTH**4 / (8 * EI), rel=1e-6)


def test_meshed_cantilever_with_static_shape_sag():
    steel = fem.Material(210e9, 0.3, 7850.0)
    tube = fem.sections.Tube(0.02, 0.001)
    structure = fem.build_structure(line([[0, 0, 0], [LENGTH, 0, 0]], 4), [fem.Member("line", "beam", tube, steel)])
    modes = with_attachment(structure, cantilever_modes(structure, ["start"], 2), ["z"])
    body = reduce_structure(structure, modes, {"tip": "end"})
    found = equilibrium(System({"boom": body}, (weld("boom"),), environment=DOWN))
    sag = found.model.observe(np.zeros(1), found.x[None])["markers/boom.tip/deflection"][0, 2]
    area, I = np.pi * (0.02**2 - 0.019**2), np.pi / 4 * (0.02**4 - 0.019**4)
    assert sag == pytest.approx(-7850.0 * area * G * LENGTH**4 / (8 * 210e9 * I), rel=1e-6)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("strain", ["linear", "nonlinear", "condensed"])
@pytest.mark.parametrize("method, drift", [("dop853", 1e-9), ("esdirk4", 1e-5)])
def test_swinging_flexible_rod_conserves_energy(strain, method, drift):
    """A physical pendulum of a rod that bends by a tenth of its length; without the rod's weight it would not move."""
    body = slender(strain, axial=2, bending=3, stiffness=60.0)
    joint = revolute("rod", axis=[0, 1, 0], child_marker="root", q0=[0.5])
    model = compile_system(System({"rod": body}, (joint,), environment=DOWN))
    times = np.linspace(0.0, 2.0, 41)
    solution = integrator(method, rtol=1e-11 if method == "dop853" else 1e-8).solve(model, times, model.x0)
    out = model.observe(solution.times, solution.states)
    assert np.ptp(out["monitors/gravity"]) > 50.0  # J
    assert np.abs(out["markers/rod.tip/deflection"]).max() > 0.02 * LENGTH
    assert np.ptp(out["monitors/energy"]) < drift * np.ptp(out["monitors/gravity"])


@pytest.mark.sampled(1)
@pytest.mark.parametrize("strain, axial", [("condensed", 0), ("nonlinear", 24)])
def test_hanging_chain_has_bessel_frequencies(strain, axial):
    """VALIDATION F9: omega_k = j_0k sqrt(g / L) / 2; a beam with hardly any stiffness, hinged at its upper end."""
    beam = UniformBeam(LENGTH, 1e5, 4e-4, 4e-4, 4e-4, RHO_A, direction=(0, 0, -1), rotary_inertia=False)
    functions = BeamFunctions(y=12, z=0, axial=axial, family="polynomial")
    body = beam_body(beam, functions, strain=strain)
    hinge = np.cross(body.marker("tip").phi[:, 0], [0, 0, 1.0])
    found = equilibrium(
        System({"chain": body}, (revolute("chain", axis=hinge, child_marker="root"),), environment=DOWN)
    )
    omega = np.unique(np.round(np.abs(found.eigenvalues.imag), 9))[:3]
    assert omega == pytest.approx(jn_zeros(0, 3) / 2 * np.sqrt(G / LENGTH), rel=1e-3)  # what stiffness is left


def test_free_fall_conserves_angular_momentum():
    system, _, (q, u) = random_tree(4, root=free, environment=ASKEW)
    model, times = compile_system(system), np.linspace(0.0, 1.0, 11)
    solution = integrator("dop853", rtol=1e-11).solve(model, times, np.concatenate([q, u]))
    out = model.observe(times, solution.states)
    mass = sum(body.moments.mass for body in system.bodies.values())
    start, rate = out["monitors/center_of_mass"][0], out["monitors/momentum"][0] / mass
    fall = start + times[:, None] * rate + times[:, None] ** 2 / 2 * ASKEW.gravity
    assert out["monitors/center_of_mass"] == pytest.approx(fall, abs=1e-8)
    assert np.ptp(out["monitors/angular_momentum"], axis=0) == pytest.approx(np.zeros(3), abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("strain, axial", [("condensed", 0), ("nonlinear", 12)])
def test_column_buckles_under_own_weight_at_greenhill_length(strain, axial):
    """q L^3 / EI = 7.8373 (Greenhill 1881: 9/4 of the square of the first zero of J_-1/3)."""
    stands = {}
    for share in (0.995, 1.005):
        stiffness = RHO_A * G * LENGTH**3 / (7.83735 * share)
        beam = UniformBeam(
            LENGTH, 1e9, stiffness, stiffness, stiffness, RHO_A, direction=(0, 0, 1), rotary_inertia=False
        )
        body = beam_body(beam, BeamFunctions(y=5, z=5, axial=axial, family="polynomial"), strain=strain)
        stands[share] = equilibrium(System({"column": body}, (weld("column"),), environment=DOWN)).stable
    assert stands == {0.995: True, 1.005: False}
