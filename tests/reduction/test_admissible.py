"""Beam functions by their equations and end conditions; the analytic body against the finite-element one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from support.reduction_examples import EI_Y, EI_Z, LENGTH, MASS, slender_beam

from femflex.fem import Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.mesh.generators import line
from femflex.reduction import (
    BeamFunctions,
    ModalDamping,
    UniformBeam,
    beam_body,
    cantilever_modes,
    effective_mass,
    mac_of_bodies,
    reduce_structure,
    sampled_functions,
)
from femflex.reduction.beams.beam_functions import (
    CONDITIONS,
    STATIC_AXIAL,
    STATIC_BENDING,
    axial_characteristic,
    bending_characteristic,
    bending_roots,
    gauss,
    polynomials,
    with_static,
)
from femflex.reduction.boundary.rigid import check_no_rigid_motion

ENDS = [
    "clamped-free",
    "free-free",
    "clamped-clamped",
    "clamped-pinned",
    "pinned-pinned",
    "pinned-free",
    "free-clamped",
]
DIRECTION = (3.0, 4.0, 1.0)
XI, WEIGHT = gauss(500)


def beam(**changes):
    data = dict(EA=1e6, EIy=EI_Y, EIz=EI_Z, GJ=100.0, mass_per_length=MASS, ry=1e-3, rz=1e-3, direction=DIRECTION)
    return UniformBeam(LENGTH, **{**data, "rotary_inertia": False, **changes})


@pytest.mark.parametrize(
    ("ends", "roots"),
    [
        ("clamped-free", [1.87510406871196, 4.69409113297417, 7.85475743823761]),
        ("free-free", [4.73004074486270, 7.85320462409584, 10.9956078380017]),
        ("clamped-clamped", [4.73004074486270, 7.85320462409584, 10.9956078380017]),
        ("clamped-pinned", [3.92660231204792, 7.06858274562873, 10.2101761228130]),
        ("pinned-free", [3.92660231204792, 7.06858274562873, 10.2101761228130]),
        ("pinned-pinned", [np.pi, 2 * np.pi, 3 * np.pi]),
    ],
)
def test_roots_are_the_textbook_ones(ends, roots):
    assert bending_roots(ends, 3) == pytest.approx(roots, rel=1e-13)


@pytest.mark.parametrize("ends", ENDS)
def test_characteristic_functions_solve_their_equation_and_meet_their_ends_at_any_order(ends):
    n = 60
    f, roots = bending_characteristic(ends, n), bending_roots(ends, n)
    xi = np.linspace(0, 1, 301)
    assert np.abs(f(xi, 4) / roots**4 - f(xi, 0)).max() < 1e-12
    for at, support in zip((0.0, 1.0), ends.split("-"), strict=True):
        for derivative in CONDITIONS[support]:
            assert np.abs(f(np.array([at]), derivative) / roots**derivative).max() < 1e-12
    gram = (f(XI, 0) * WEIGHT[:, None]).T @ f(XI, 0)
    assert np.abs(gram - np.eye(n)).max() < 1e-11
    assert np.abs(f(xi, 0)).max() < 2.1  # no growth: cosh and cos never cancel


def test_a_free_tip_points_up():
    assert np.all(bending_characteristic("clamped-free", 20)(np.array([1.0]), 0) == pytest.approx(2.0, abs=1e-10))


@pytest.mark.parametrize(("p", "q"), [(2, 0), (0, 0), (1, 0), (1, 1), (2, 2), (2, 1), (0, 2)])
def test_polynomials_are_orthonormal_and_meet_their_ends(p, q):
    n = 25
    f = polynomials(p, q, n)
    gram = (f(XI, 0) * WEIGHT[:, None]).T @ f(XI, 0)
    assert np.abs(gram - np.eye(n)).max() < 1e-10
    for at, order in ((0.0, p), (1.0, q)):
        for derivative in range(order):
            assert np.abs(f(np.array([at]), derivative)).max() < 1e-9


@pytest.mark.parametrize(("p", "q"), [(0, 0), (1, 0), (0, 1)])
def test_polynomials_hold_no_rigid_motion_their_ends_allow(p, q):
    f = polynomials(p, q, 8)
    rigid = [np.ones_like(XI), XI] if p + q == 0 else [XI if p else 1 - XI]
    for motion in rigid:
        assert np.abs((WEIGHT * motion) @ f(XI, 0)).max() < 1e-13


def test_polynomials_of_a_held_bar_begin_with_uniform_strain():
    assert np.ptp(polynomials(1, 0, 1, rigid=1)(XI, 1)) < 1e-12
    assert np.abs(WEIGHT @ polynomials(0, 0, 5, rigid=1)(XI, 0)).max() < 1e-13


@pytest.mark.parametrize(
    "functions",
    [
        bending_characteristic("clamped-free", 6),
        axial_characteristic("clamped-free", 6),
        axial_characteristic("free-free", 6),
        polynomials(2, 0, 9),
        with_static(bending_characteristic("clamped-free", 4), STATIC_BENDING, 6),
        with_static(axial_characteristic("clamped-free", 4), STATIC_AXIAL, 5),
    ],
)
def test_derivatives_agree_with_differences(functions):
    xi, h = np.linspace(0.1, 0.9, 17), 1e-5
    for order in (0, 1):
        difference = (functions(xi + h, order) - functions(xi - h, order)) / (2 * h)
        exact = functions(xi, order + 1)
        assert np.abs(difference - exact).max() < 1e-5 * np.abs(exact).max()


def test_static_shapes_complete_the_answer_to_a_root_that_accelerates_or_turns():
    f = with_static(bending_characteristic("clamped-free", 4), STATIC_BENDING, 6)
    gram = (f(XI, 0) * WEIGHT[:, None]).T @ f(XI, 0)
    assert np.abs(gram - np.eye(6)).max() < 1e-9  # the static rest is a difference of 1e6 times its size
    K = (f(XI, 2) * WEIGHT[:, None]).T @ f(XI, 2)
    for load in (np.ones_like(XI), XI):
        answer = f(np.array([1.0]), 0) @ np.linalg.solve(K, (WEIGHT * load) @ f(XI, 0))
        tip = 1 / 8 if load[0] == load[-1] else 11 / 120  # of a unit cantilever under w'''' = 1 and = x
        assert answer[0] == pytest.approx(tip, rel=1e-10)


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("functions", "tolerance"),
    [
        (BeamFunctions(5, 5, 2, 2), 2e-9),
        (BeamFunctions(7, 7, 3, 3, static=True), 2e-9),
        (BeamFunctions(12, 12, 6, 6, family="polynomial"), 2e-9),
    ],
    ids=["characteristic", "static", "polynomial"],
)
def test_the_analytic_body_is_the_finite_element_one(functions, tolerance):
    structure = slender_beam(direction=DIRECTION)
    fe = reduce_structure(structure, cantilever_modes(structure, "start", 6), {"tip": "end"})
    body = beam_body(beam(), functions)
    assert body.omega[:6] == pytest.approx(fe.omega, rel=tolerance)
    assert body.moments.mass == pytest.approx(fe.moments.mass)
    assert body.moments.inertia() == pytest.approx(fe.moments.inertia(), rel=1e-9, abs=1e-9)
    assert body.moments.first[:7] == pytest.approx(fe.moments.first, abs=1e-6)
    assert effective_mass(body).effective[:6] == pytest.approx(effective_mass(fe).effective, abs=1e-6)
    assert body.marker("tip").position == pytest.approx(fe.marker("tip").position)
    assert body.marker("tip").phi[:, :6] == pytest.approx(fe.marker("tip").phi, abs=2e-6)
    assert body.marker("tip").psi[:, :6] == pytest.approx(fe.marker("tip").psi, abs=2e-5)
    assert not body.marker("root").phi.any() and not body.marker("root").psi.any()
    assert np.diag(mac_of_bodies(body, fe))[:2].min() > 0.99


@pytest.mark.slow
def test_second_moments_agree_too_torsion_and_axial_motion_included():
    section = StiffnessSection(EA=1e4, EIy=EI_Y, EIz=EI_Z, GJ=2.0, mass_per_length=MASS, ry=0.04, rz=0.07)
    end = LENGTH * np.array(DIRECTION) / np.linalg.norm(DIRECTION)
    member = Member("line", "beam", section, options={"order": 7})
    structure = build_structure(line([[0, 0, 0], end.tolist()], 8), [member])
    fe = reduce_structure(structure, cantilever_modes(structure, "start", 12))
    functions = BeamFunctions(16, 16, 20, 20, "polynomial")
    body = beam_body(beam(EA=1e4, GJ=2.0, ry=0.04, rz=0.07, rotary_inertia=True), functions)
    assert body.omega[:12] == pytest.approx(fe.omega, rel=1e-8)
    assert body.moments.second[:13, :, :13, :] == pytest.approx(fe.moments.second, abs=2e-5)


def test_orthonormal_or_not_it_is_the_same_body():
    functions = BeamFunctions(4, 4, 1, 1, family="polynomial")
    plain, made = (beam_body(beam(rotary_inertia=True, ry=0.05), functions, orthonormal=flag) for flag in (False, True))
    assert np.isnan(plain.omega).all() and plain.kinds == ("admissible",) * 10
    values = eigh(plain.strain.V1, plain.moments.elastic_mass(), eigvals_only=True)
    assert made.omega == pytest.approx(np.sqrt(values), rel=1e-9)
    assert made.moments.elastic_mass() == pytest.approx(np.eye(10), abs=1e-12)
    assert effective_mass(plain).effective == pytest.approx(effective_mass(made).effective, abs=1e-9)


def test_free_free_functions_move_with_the_mean():
    body = beam_body(beam(), BeamFunctions(4, 4, 1, 1, ends="free-free"))
    assert effective_mass(body).carried.max() < 1e-12
    exact = np.array([4.73004074486270, 7.85320462409584]) ** 2 * np.sqrt(EI_Z / (MASS * LENGTH**4))
    assert np.isin(np.round(exact, 6), np.round(body.omega, 6)).all()


def test_damping_and_both_skins():
    body = beam_body(beam(), BeamFunctions(2, 1), damping=ModalDamping(0.01))
    assert np.diag(body.damping) == pytest.approx(0.02 * body.omega)
    assert list(body.skin.cells) == ["line"] and body.skin.shapes.shape == (3, len(body.skin.points), 3)
    tube = beam_body(beam(radius=0.2), BeamFunctions(2, 1)).skin
    x = np.array(DIRECTION) / np.linalg.norm(DIRECTION)
    off = tube.points - np.outer(tube.points @ x, x)
    assert np.linalg.norm(off, axis=1) == pytest.approx(0.2)
    corners = tube.points[tube.cells["quad"]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = off[tube.cells["quad"]].mean(axis=1)
    assert np.all(np.einsum("qi,qi->q", normal, outward) < 0) or np.all(np.einsum("qi,qi->q", normal, outward) > 0)


def test_sampled_functions_span_the_modes_of_a_mesh():
    structure = slender_beam(n=60, order=3, direction=DIRECTION)
    modes = sampled_functions(structure, beam(), BeamFunctions(5, 5), clamp="start")
    body = reduce_structure(structure, modes, {"tip": "end"})
    assert effective_mass(body).omega[:4] == pytest.approx(cantilever_modes(structure, "start", 4).omega, rel=1e-6)
    assert modes.kinds == ("admissible",) * 10 and "start" in body.markers


def test_nodes_off_the_line_are_refused():
    with pytest.raises(ValueError, match=r"nodes lie up to 4.29 m off the beam's line and 0 m past its ends"):
        sampled_functions(slender_beam(direction=(0, 1, 0)), beam(direction=(3, 3, 4)), BeamFunctions(2))
    ends = slender_beam(direction=DIRECTION)
    forward = 0.5 * np.asarray(DIRECTION) / np.linalg.norm(DIRECTION)
    for root, past in (
        (forward, "0.5"),
        (-forward, "0.5"),
    ):  # a mesh that begins before the root; that ends past the tip
        with pytest.raises(ValueError, match=f"off the beam's line and {past} m past its ends"):
            sampled_functions(ends, beam(root=root), BeamFunctions(2))


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        *(
            (
                lambda key=key, value=value: beam(**{key: value}),
                f"{key} of the beam is {value}; it must be positive and finite",
            )
            for key, value in zip(
                ("EA", "EIy", "EIz", "GJ", "mass_per_length"),
                (-1.0, 0.0, np.inf, 0.0, np.nan),
                strict=True,
            )
        ),
        (lambda: beam(ry=-1.0), "ry of the beam is -1.0; a radius of gyration is zero or positive"),
        (
            lambda: BeamFunctions(2, ends="clamped-loose"),
            "ends 'clamped-loose' are not understood; give root and tip as two",
        ),
        (lambda: BeamFunctions(2, family="spline"), "family 'spline' of beam functions is not known"),
        (lambda: BeamFunctions(), r"numbers of beam functions .* are \(0, 0, 0, 0\)"),
        (lambda: BeamFunctions(2, -1), "give at least one, and none negative"),
        (
            lambda: BeamFunctions(3, ends="free-free", static=True),
            "static shapes go with characteristic functions",
        ),
        (lambda: BeamFunctions(1, static=True), "static shapes of bending come in twos"),
        (lambda: beam_body(beam(ry=0.0, rz=0.0), BeamFunctions(2, torsion=1)), "the section has no inertia"),
    ],
)
def test_beams_and_functions_that_cannot_be_are_refused(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


@pytest.mark.parametrize("phi", [[[1.0, 0.0], [2.0, 0.0], [0.5, 0.0]], [[1.0, -2.0], [2.0, -4.0], [0.5, -1.0]]])
def test_shapes_that_are_zero_or_multiples_of_others_are_refused(phi):
    with pytest.raises(
        ValueError, match=r"the 2 shapes are not independent \(smallest singular value \d\.\de[+-]\d\d of"
    ):
        check_no_rigid_motion(np.zeros((3, 0)), np.array(phi), np.ones(3))
