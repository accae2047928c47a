"""Tension of tethers and membranes along runs, by their loads: slackness is seen where and when it comes."""

import numpy as np
import pytest

from femflex.advice.bodies import KnownBodies
from femflex.advice.tension import TensionWatch
from femflex.body import rigid_body
from femflex.dynamics import compile_system
from femflex.fem import Member, build_structure
from femflex.fem.sections import CableSection
from femflex.mesh import line
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives
from femflex.reduction.origin import Meshed, Origin
from femflex.reduction.preload.equilibrium import static_equilibrium
from femflex.reduction.preload.loads import Preload
from femflex.system import Environment, Frame, System, spherical, weld
from femflex.warning import PhysicsWarning

L, MASS, END = 3.0, 0.3, 0.5  # m, kg/m, kg
PIN = {"start": ("x", "y", "z")}


def cord(preload, strain):
    """A tether along x about its equilibrium, and what it was reduced from."""
    section = CableSection(1e5, MASS)
    structure = build_structure(line([[0, 0, 0], [L, 0, 0]], 8), [Member("line", "tether", section)])
    structure = static_equilibrium(structure, PIN, preload)
    modes = cantilever_modes(structure, PIN, 6)
    modes = modes if strain == "linear" else with_derivatives(structure, modes, 8)
    body = reduce_structure(structure, modes, {"end": "end"}, strain=strain, turning=())
    return body, KnownBodies({"cord": Origin(Meshed(structure, modes, {"end": "end"}))})


def seen(system, known):
    """Tension of the watched elements (k,) at the start, their places, and the watch."""
    model = compile_system(system)
    watch = TensionWatch(model, known)
    channels = model.observe(np.zeros(1), model.x0[None])
    watch.watch(np.zeros(1), channels)
    (one,) = watch._watched
    return watch.tension(one, channels)[0], one.places[:, 0], watch


@pytest.mark.parametrize("strain", ["linear", "condensed"])
@pytest.mark.parametrize("rate", [2.0, 3.0])
def test_it_follows_the_spin_and_what_is_attached(strain, rate):
    body, known = cord(Preload.spin([0, 0, 2.0], masses={"end": END}), strain)
    ball = rigid_body(END, np.eye(3))
    joints = (weld("cord", child_marker="start"), spherical("ball", parent="cord", parent_marker="end"))
    frame = Frame("spinning", np.array([0, 0, rate]))
    found, x, _ = seen(System({"cord": body, "ball": ball}, joints, frame=frame), known)
    half = L / 16  # the mean over an element of T = Om^2 [m' (L^2 - x^2)/2 + END L]
    exact = rate**2 * (MASS / 2 * (L**2 - x**2 - half**2 / 3) + END * L)
    assert found == pytest.approx(exact, rel=2e-4)


@pytest.mark.parametrize("strain", ["linear", "condensed"])
def test_slackness_is_told_with_time_place_and_depth(strain):
    """Hung under 9.81 m/s^2, then pushed up by 2 m/s^2 instead."""
    body, known = cord(Preload.weight([9.81, 0, 0]), strain)
    for g, slack in ((9.81, False), (-2.0, True)):
        system = System(
            {"cord": body}, (weld("cord", child_marker="start"),), environment=Environment(np.array([g, 0, 0]))
        )
        found, x, watch = seen(system, known)
        assert found == pytest.approx(MASS * g * (L - x), abs=2e-3 * MASS * 9.81 * L)
        if slack:
            text = r"tether on group 'line' went slack at t = 0 s near \(0.18.*falls to -1.68.* N, below zero"
            with pytest.warns(PhysicsWarning, match=text):
                watch.warn()
        else:
            watch.warn()
