"""Columns beyond Euler's load, and other things that leave an unstable equilibrium: where they come to rest."""

from functools import cache

import numpy as np
import pytest
from scipy.special import ellipe, ellipk
from support.elastica import EI, LENGTH, SECTION, cantilever

from femflex import equilibrium, fem
from femflex.body import Marker, rigid_body
from femflex.dynamics.equilibria.equilibrium import EquilibriumError
from femflex.mesh import line
from femflex.reduction import cantilever_modes, reduce_structure, with_attachment, with_derivatives
from femflex.system import Environment, Load, System, revolute, weld

EULER = np.pi**2 * EI / (4 * LENGTH**2)
TABLE = {20: (1.015, 0.220, 0.970), 40: (1.063, 0.422, 0.881), 60: (1.152, 0.593, 0.741)}  # Timoshenko and Gere (1961)


def column(angle):
    """P / P_cr, w/L, u/L of a cantilever pressed along until its tip slopes by so many degrees: elliptic integrals."""
    sine = np.sin(np.radians(angle) / 2)
    K, E = ellipk(sine**2), ellipe(sine**2)
    return (2 * K / np.pi) ** 2, 2 * sine / K, 2 - 2 * E / K


def tip(found):
    """Deflection (3,) of the column's tip [m]."""
    return found.model.observe(np.zeros(1), found.x[None])["markers/beam.tip/deflection"][0]


@pytest.mark.parametrize("angle", TABLE)
def test_the_integrals_are_those_of_the_table(angle):
    ratio, w, u = column(angle)
    assert (ratio, w, 1 - u) == pytest.approx(TABLE[angle], abs=1e-3)


@pytest.mark.slow
@pytest.mark.sampled(1)
@pytest.mark.parametrize(("angle", "error"), [(20, 0.005), (40, 5e-4), (60, 5e-4)])
def test_a_straight_column_left_along_what_grows_comes_to_the_elastica(angle, error):
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


@pytest.mark.slow
def test_a_load_off_the_axis_bends_the_column_to_its_own_side():
    """Newton's method meets the small bend against the load first, which is none that lasts."""
    ratio, w, _ = column(40)
    for side in (1, -1):
        load = ratio * EULER * np.array([-1.0, 0, side * 1e-3])
        nearest, lasting = (equilibrium(cantilever(12, load), stable=stable) for stable in (False, True))
        assert not nearest.stable and side * tip(nearest)[2] < 0 and nearest.left is None
        assert lasting.stable and side * tip(lasting)[2] == pytest.approx(w * LENGTH, rel=0.02)


@pytest.mark.slow
def test_a_follower_force_that_makes_a_column_flutter_leaves_nowhere_to_go():
    """Beck's load is 20.05 EI / L^2: beyond it the straight column swings ever wider, and no other rest is near."""
    beck = 20.05 * EI / LENGTH**2
    with pytest.raises(EquilibriumError, match=r"grows in oscillations.*no stable one was found from it") as told:
        equilibrium(cantilever(8, [-1.05 * beck, 0, 0], frame="marker"), stable=True)
    assert not told.value.last.stable


def test_pendulums_upside_down_fall_over():
    """Two rods under their weight, upright within 1e-9: both hang in the end."""
    rod = rigid_body(2.0, np.diag([0.01, 0.2, 0.2]), [0.5, 0, 0], markers={"end": Marker.rigid([1.0, 0, 0])})
    joints = (
        revolute("upper", axis=[0, 1, 0], q0=[-np.pi / 2]),
        revolute("lower", "upper", axis=[0, 1, 0], parent_marker="end"),
    )
    system = System({"upper": rod, "lower": rod}, joints, environment=Environment(gravity=np.array([0, 0, -9.81])))
    found = equilibrium(system, stable=True)
    assert not found.left.stable and found.stable
    assert np.cos(found.q - [np.pi / 2, 0]) == pytest.approx(1.0, abs=1e-9)


@cache
def whole(strain):
    """The column as one body: four vibration shapes, the tip load's own, all their derivatives; L/r = 4472."""
    structure = fem.build_structure(line([[0, 0, 0], [LENGTH, 0, 0]], 8), [fem.Member("line", "beam", SECTION)])
    modes = with_attachment(structure, cantilever_modes(structure, "start", 4), (), {"end": ["y", "z"]})
    modes = with_derivatives(structure, modes, "all")
    return reduce_structure(structure, modes, {"root": "start", "tip": "end"}, strain=strain)


def pressed(force, strain="nonlinear", **options):
    """Its equilibrium under a dead force (3,) at the tip [N]."""
    load = Load("pull", "beam", "tip", frame="inertial", force=np.asarray(force, float))
    joint = weld("beam", child_marker="root")
    return equilibrium(System({"beam": whole(strain)}, (joint,), (load,)), **options)


@pytest.mark.parametrize("part", [0.5, 0.9, 0.95])
def test_slender_bodies_that_can_stretch_come_to_rest_in_a_few_steps(part):
    """Steps that stretch what they bend would have to stay shorter than r / L: they were 890 at 0.95."""
    found = pressed(part * EULER * np.array([-1.0, 0, 0.01]))
    assert found.stable and found.iterations < 20


@pytest.mark.slow
def test_one_body_that_can_stretch_buckles_as_far_as_the_elastica_to_a_slope_of_twenty_degrees():
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


def test_a_condensed_body_shortens_to_second_order_and_stays_behind():
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
