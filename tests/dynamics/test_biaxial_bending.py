"""Motion of a strip that bends both ways and twists: one condensed body against segments, and its energy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femflex import fem, reduction, system
from femflex.dynamics import compile_system
from femflex.dynamics.reports.marker_motion import marker_motion
from femflex.dynamics.terms.without import with_linear_strain
from femflex.integrate import integrator
from femflex.mesh import line
from femflex.system import Load, System, weld

LENGTH, EI, TIMES = 10.0, 1.4e4, np.linspace(0, 2, 41)
SECTION = fem.sections.StiffnessSection(2.8e7, 5 * EI, EI, 4e3, 1.2, ry=0.0224, rz=0.0224)
MEMBERS = [fem.Member("line", "beam", SECTION, None, {"orientation": (0, 1, 0)})]
MARKERS = {"tip": "end", "root": "start"}


def mesh(elements):
    return line([[0, 0, 0], [LENGTH, 0, 0]], elements)


def one():
    structure = fem.build_structure(mesh(8), MEMBERS)
    shapes = reduction.with_derivatives(structure, reduction.cantilever_modes(structure, "start", 8), "all")
    return reduction.reduce_structure(structure, shapes, MARKERS, strain="condensed")


def segmented(k):
    return system.Segments(reduction.reduce_segments(fem.cut(mesh(12), MEMBERS, k), MARKERS))


FORCE = np.array([0.0, 40.0, -200.0])  # dead, skew to both planes


def moved(body, share, build=System, method="dop853", rtol=1e-7):
    """Model and states after the load has come upon the tip at t = 0."""
    load = Load("P", "beam", "tip", frame="inertial", force=share * FORCE)
    model = compile_system(build({"beam": body}, (weld("beam", None, child_marker="root"),), (load,)))
    return model, integrator(method, rtol=rtol, atol=rtol).solve(model, TIMES, model.x0).states


def tip(model, states):
    """Place of the tip (n_t, 3) and its twist (n_t,): what is left of its turn beyond the shortest to its tangent."""
    seen = model.observe(TIMES, states)
    C = marker_motion(model.system, TIMES, seen, model.system.order[-1], "tip")[1]
    twist = []
    for turn in C:
        bend = Rotation.from_rotvec(shortest(turn[:, 0])).as_matrix().T @ turn
        twist.append(np.arctan2(bend[2, 1], bend[1, 1]))
    return seen["markers/beam.tip/position"], np.array(twist)


def shortest(tangent):
    """Rotation vector of the shortest turn of x into that unit vector."""
    axis = np.cross([1.0, 0, 0], tangent)
    return axis * np.arctan2(np.linalg.norm(axis), tangent[0]) / max(np.linalg.norm(axis), 1e-300)


def test_energy_and_the_work_of_the_load_balance():
    model, states = moved(one(), 0.4)
    seen = model.observe(TIMES, states)
    way = seen["markers/beam.tip/position"]
    work = (way - way[0]) @ (0.4 * FORCE)
    energy = seen["monitors/kinetic"] + seen["monitors/elastic"]
    assert np.abs(energy - energy[0] - work).max() < 1e-6 * work.max()
    assert np.ptp(way, axis=0).min() > 0.005 * LENGTH and np.abs(tip(model, states)[1]).max() > 0.03  # all ways
    linear = compile_system(replace(model.system, bodies={"beam": with_linear_strain(one())})).observe(TIMES, states)
    wrong = linear["monitors/kinetic"] + linear["monitors/elastic"]
    assert np.abs(wrong - wrong[0] - work).max() > 1e-3 * work.max()  # the balance sees what is not linear


@pytest.mark.slow
def test_the_tip_follows_that_of_segments_within_half_a_per_cent():
    """Place over the largest motion, x and then y, z, and twist over the largest twist; and with linear strain."""
    own, other, coarse = [], [], []
    for share in (0.4, 0.2):
        six, twelve = (tip(*moved(segmented(k), share, system.assembled, "esdirk4", 1e-6)) for k in (6, 12))
        exact = [b + (b - a) / 3 for a, b in zip(six, twelve, strict=True)]
        sizes = np.ptp(exact[0], axis=0).max(), np.abs(exact[1]).max()
        for kept, found in (
            (own, tip(*moved(one(), share))),
            (other, tip(*moved(with_linear_strain(one()), share))),
            (coarse, twelve),
        ):
            place = np.abs(found[0] - exact[0]).max(axis=0) / sizes[0]
            kept.append([place[0], place[1:].max(), np.abs(found[1] - exact[1]).max() / sizes[1]])
    own, other, coarse = np.array(own), np.array(other), np.array(coarse)
    assert (own < [[0.001, 0.005, 0.16], [5e-4, 0.002, 0.1]]).all()  # bent by 8 % of the length
    assert other[0, 0] > 0.06 and other[:, 2] == pytest.approx([1.0, 1.0])  # linear strain: no shortening, no twist
    assert (coarse[:, :2] < 1e-3).all() and (coarse[:, 2] < 0.06).all()  # what it is judged by
