"""Buckled columns against the elastica; lateral-torsional buckling of strips against Prandtl."""

from functools import cache

import numpy as np
import pytest
from scipy.special import ellipe, ellipk
from support.elastica import EI, LENGTH, SECTION, cantilever

from femflex import equilibrium, fem, reduction, system
from femflex.body import Marker, rigid_body
from femflex.mesh import line
from femflex.reduction import cantilever_modes, reduce_structure, with_attachment, with_derivatives
from femflex.system import Environment, Load, System, revolute, weld

EULER = np.pi**2 * EI / (4 * LENGTH**2)


def column(angle):
    """P / P_cr, w/L, u/L of a cantilever pressed along until its tip slopes by so many degrees: elliptic integrals."""
    sine = np.sin(np.radians(angle) / 2)
    K, E = ellipk(sine**2), ellipe(sine**2)
    return (2 * K / np.pi) ** 2, 2 * sine / K, 2 - 2 * E / K


def tip(found):
    """Deflection (3,) of the column's tip [m]."""
    return found.model.observe(np.zeros(1), found.x[None])["markers/beam.tip/deflection"][0]


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize(("angle", "error"), [(20, 0.005), (40, 5e-4), (60, 5e-4)])
def test_buckled_column_of_segments_matches_elastica(angle, error):
    """By segments, whose error falls with the square of their number; nearest to Euler's load it counts most."""
    ratio, w, u = column(angle)
    found = [equilibrium(cantilever(k, [-ratio * EULER, 0, 0]), stable=True) for k in (8, 16)]
    for each in found:
        assert each.stable and not each.left.stable and "grows monotonically" in each.left.verdict
        assert tip(each.left)[1:] == pytest.approx(0.0, abs=1e-9)
    moved = np.array([tip(each) for each in found]) / LENGTH
    aside, along = np.hypot(moved[:, 1], moved[:, 2]), -moved[:, 0]
    assert (4 * aside[1] - aside[0]) / 3 == pytest.approx(w, rel=error)
    assert (4 * along[1] - along[0]) / 3 == pytest.approx(u, rel=2 * error)


def test_inverted_pendulums_end_hanging():
    """Two rods under their weight, upright within 1e-9: both hang in the end."""
    rod = rigid_body(2.0, np.diag([0.01, 0.2, 0.2]), [0.5, 0, 0], markers={"end": Marker.at_position([1.0, 0, 0])})
    joints = (
        revolute("upper", axis=[0, 1, 0], q0=[-np.pi / 2]),
        revolute("lower", "upper", axis=[0, 1, 0], parent_marker="end"),
    )
    system = System({"upper": rod, "lower": rod}, joints, environment=Environment(gravity=np.array([0, 0, -9.81])))
    found = equilibrium(system, stable=True)
    assert not found.left.stable and found.stable
    assert np.cos(found.q - [np.pi / 2, 0]) == pytest.approx(1.0, abs=1e-9)


@cache
def column_of_one_body(strain):
    """The column as one body: four vibration shapes, the tip load's own, all their derivatives; L/r = 4472."""
    structure = fem.build_structure(line([[0, 0, 0], [LENGTH, 0, 0]], 8), [fem.Member("line", "beam", SECTION)])
    modes = with_attachment(structure, cantilever_modes(structure, "start", 4), (), {"end": ["y", "z"]})
    modes = with_derivatives(structure, modes, "all")
    return reduce_structure(structure, modes, {"root": "start", "tip": "end"}, strain=strain)


def pressed(force, strain="nonlinear", **options):
    """Its equilibrium under a dead force (3,) at the tip [N]."""
    load = Load("pull", "beam", "tip", frame="inertial", force=np.asarray(force, float))
    joint = weld("beam", child_marker="root")
    return equilibrium(System({"beam": column_of_one_body(strain)}, (joint,), (load,)), **options)


@pytest.mark.slow
def test_buckled_column_of_one_nonlinear_body_matches_elastica():
    """Curvature to third order alone went 13 % too far there: the square of u' v'' wants three of it, not one.

    At ten degrees what the shapes lack of Euler's load (1.6e-4) counts 4 / slope^2 = 130 times.
    """
    for angle, error in ((10, 0.03), (20, 5e-3)):
        ratio, w, u = column(angle)
        found = pressed([-ratio * EULER, 0, 0], stable=True)
        moved = tip(found) / LENGTH
        assert found.stable and not found.left.stable
        assert np.hypot(*moved[1:]) == pytest.approx(w, rel=error)
        assert -moved[0] == pytest.approx(u, rel=2 * error)


def test_buckled_column_of_condensed_body_is_second_order():
    """Of v = w (1 - cos kx), k = pi / 2L: bending EI/2 v''^2 (1 + v'^2), but the load's work P v'^2 / 2 alone.

    Its balance is (wk)^2 = 2 (P / P_cr - 1), about half the elastica's w, and the end comes (wk)^2 / 4 along.
    """
    for angle, error in ((20, 0.01), (30, 0.01)):
        ratio, _, _ = column(angle)
        found = pressed([-ratio * EULER, 0, 0], "condensed", stable=True)
        moved = tip(found) / LENGTH
        assert found.stable and not found.left.stable
        assert np.hypot(*moved[1:]) == pytest.approx(np.sqrt(2 * (ratio - 1)) / (np.pi / 2), rel=error)
        assert -moved[0] == pytest.approx((ratio - 1) / 2, rel=3 * error)


LENGTH_OF_LATERAL_BUCKLING, EI_OF_LATERAL_BUCKLING, GJ = 10.0, 1.4e4, 1.2e3  # m, N m^2 about the weak axis
PRANDTL = 4.0126 * np.sqrt(EI_OF_LATERAL_BUCKLING * GJ) / LENGTH_OF_LATERAL_BUCKLING**2


def members(ratio):
    section = fem.sections.StiffnessSection(
        2.8e7, ratio * EI_OF_LATERAL_BUCKLING, EI_OF_LATERAL_BUCKLING, GJ, 1.2, ry=0.0224, rz=0.0224
    )
    return [fem.Member("line", "beam", section, None, {"orientation": (0, 1, 0)})]


@cache
def strip(ratio, elements=8, modes=12):
    """One condensed body with a stiff plane `ratio` times as stiff as the weak one."""
    structure = fem.build_structure(line([[0, 0, 0], [LENGTH_OF_LATERAL_BUCKLING, 0, 0]], elements), members(ratio))
    shapes = reduction.with_derivatives(structure, reduction.cantilever_modes(structure, "start", modes))
    return reduction.reduce_structure(structure, shapes, {"tip": "end", "root": "start"}, strain="condensed")


def lowest(body, share, build=system.System):
    """The square of the lowest frequency under a dead tip load, a share of Prandtl's, in the stiff plane."""
    load = system.Load("P", "beam", "tip", frame="inertial", force=np.array([0.0, 0.0, -share * PRANDTL]))
    found = equilibrium(build({"beam": body}, (system.weld("beam", None, child_marker="root"),), (load,)))
    values = found.eigenvalues
    return -float((values[np.argmin(np.abs(values))] ** 2).real)


def critical(body, near):
    """The share of Prandtl's load at which the lowest frequency is zero, by a secant over 4 % about one near it."""
    below, above = lowest(body, near - 0.02), lowest(body, near + 0.02)
    assert below > 0 > above
    return near - 0.02 + 0.04 * below / (below - above)


@pytest.mark.parametrize("ratio", [50, 500])
def test_lateral_torsional_buckling_at_prandtl_load(ratio):
    """4.0126 sqrt(EI GJ) / L^2, over sqrt((1 - EI/EI_y) (1 - GJ/EI_y)) for the bend it starts from (Michell)."""
    exact = 1 / np.sqrt((1 - 1 / ratio) * (1 - GJ / (ratio * EI_OF_LATERAL_BUCKLING)))
    assert critical(strip(ratio), exact) == pytest.approx(exact, rel=2e-3)


def test_frequency_below_lateral_buckling_matches_segments():
    pieces = fem.cut_into_segments(line([[0, 0, 0], [LENGTH_OF_LATERAL_BUCKLING, 0, 0]], 12), members(50), 12)
    segments = system.Segments(reduction.reduce_segments(pieces, {"tip": "end", "root": "start"}))
    one, many = lowest(strip(50), 0.5), lowest(segments, 0.5, system.assembled)
    assert one < 0.85 * lowest(strip(50), 0.0)
    assert np.sqrt(one) == pytest.approx(np.sqrt(many), rel=2e-3)
