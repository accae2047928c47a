"""What condensed strain leaves out of bends that turn, from states and channels by hand; deploying members pressed."""

from __future__ import annotations

import warnings
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from femflex.advice.deployed_bending import AxialForceWatch
from femflex.advice.spun_bends import SpunBends
from femflex.assembly.system import system_of
from femflex.body import rigid_body
from femflex.case import parse_case
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import Rectangle
from femflex.mesh.generators import line
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives
from femflex.system import System, free, revolute, spherical, weld
from femflex.warning import PhysicsWarning

CARRIED = 0.7  # kg


@pytest.fixture(scope="module")
def bodies():
    """One beam in all forms of strain, of one bending mode."""
    member = Member("line", "beam", Rectangle(0.03, 0.02), Material(7e10, 0.3, 2700.0), {"orientation": (0, 0.1, 1)})
    structure = build_structure(line([[0.1, 0.2, 0.3], [1.3, 0.7, 0.4]], 3), [member])
    modes = cantilever_modes(structure, ["start"], 1)
    more = with_derivatives(structure, modes, "all")
    return {
        "arm": reduce_structure(structure, more, markers={"tip": "end"}, strain="condensed"),
        "twin": reduce_structure(structure, more, markers={"tip": "end"}, strain="condensed"),
        "stiff": reduce_structure(structure, more, strain="nonlinear"),
        "plain": reduce_structure(structure, modes),
    }, modes.omega[0]


def craft(bodies, root) -> System:
    hub, load = rigid_body(3.0, np.eye(3)), rigid_body(CARRIED, np.eye(3))
    joints = (
        root("hub"),
        revolute("arm", "hub", child_marker="start", axis=[0, 1, 0]),
        weld("load", "arm", parent_marker="tip"),
        weld("twin", "hub", child_marker="start"),
        revolute("stiff", "hub", child_marker="start", axis=[0, 1, 0]),
        weld("plain", "hub", child_marker="start"),
    )
    return System({"hub": hub, "load": load, **bodies}, joints)


def first(system, name, omega) -> float:
    """First frequency [rad/s] of one mode of unit mass, with what is carried at the tip."""
    added = CARRIED * np.linalg.norm(system.bodies[name].markers["tip"].phi[:, 0]) ** 2 if name == "arm" else 0.0
    return omega / np.sqrt(1.0 + added)


def watched(system, rows: dict[str, tuple[list, list]], places, centre=None):
    """The words of a watch over rows: body -> (bends, rates [rad/s]), each body's lever given by its root's places."""
    model = SimpleNamespace(system=system)
    watch = SpunBends(model)
    n = len(places)
    at, states = 0, {}
    for name in system.order:
        at += system.joint_of(name).n_q
        states[name] = at
        at += system.bodies[name].n_modes
    x = np.zeros((n, at + 7))
    channels = {"monitors/center_of_mass": np.zeros((n, 3)) if centre is None else centre}
    for name in ("arm", "twin", "stiff", "plain"):
        bends, rates = rows.get(name, (np.zeros(n), np.zeros(n)))
        body = system.bodies[name]
        moved = np.linalg.norm(body.skin.shapes[0], axis=1).max()
        x[:, states[name]] = np.array(bends) * np.linalg.norm(np.ptp(body.skin.points, axis=0)) / moved
        channels[f"bodies/{name}/rate"] = np.outer(rates, [2.0, -1.0, 2.0]) / 3.0
        channels[f"bodies/{name}/position"] = np.array(places)
    for part in (slice(0, 1), slice(1, n)):
        watch.watch(x[part], {key: value[part] for key, value in channels.items()})
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        watch.warn()
    assert all(one.category is PhysicsWarning for one in given)
    return [str(one.message) for one in given]


def words(name, bend, rate, times, error, remedy="For less, cut the member into segments"):
    return (
        f"body {name!r}, bent by {bend} of its size, turned at {rate:.4g} rad/s, {times} its first frequency. "
        f"Condensed strain is of second order in bends: the bend is up to about {error} off (limit 1%). {remedy}"
    )


FAR = [[9.0, 0.0, 0.0]] * 4


def test_the_error_of_a_bend_grows_with_the_squares_of_rate_and_bend_up_to_its_most(bodies):
    """c = 0.42 (rate / first)^2, at most 0.9; below 0.15 of the first frequency nothing is looked at."""
    made, omega = bodies
    system = craft(made, spherical)
    w = first(system, "arm", omega)
    assert w < 0.9 * omega
    slow = [0.99 * 0.15 * w, 1.1 * w, 0.5 * w, 0.2 * w]
    (said,) = watched(system, {"arm": ([0.9, 0.16, 0.17, 0.3], slow)}, FAR)
    assert said == words("arm", "16%", 1.1 * w, "1.1 times", f"{100 * 0.42 * 1.1**2 * 0.16**2:.1f}%")
    (said,) = watched(system, {"arm": ([0.0, 0.12, 0.11, 0.0], [0.0, 3 * w, 4 * w, 0.0])}, FAR)
    assert said == words("arm", "12%", 3 * w, "3 times", f"{100 * 0.9 * 0.12**2:.1f}%")
    assert watched(system, {"arm": ([0.0, 0.10, 0.0, 0.0], [0.0, 3 * w, 9 * w, 9 * w])}, FAR) == []


def test_each_body_of_condensed_strain_is_warned_of_with_its_own_worst_row(bodies):
    made, omega = bodies
    system = craft(made, spherical)
    w = first(system, "arm", omega)
    far = ([0.15] * 4, [2.0 * omega] * 4)
    rows = {"arm": ([0.14, 0.13, 0.12, 0.11], [4 * w] * 4), "twin": far, "stiff": far, "plain": far}
    assert watched(system, rows, FAR) == [
        words("arm", "14%", 4 * w, "4 times", f"{100 * 0.9 * 0.14**2:.1f}%"),
        words("twin", "15%", 2 * omega, "2 times", f"{100 * 0.9 * 0.15**2:.1f}%"),
    ]


@pytest.mark.parametrize("root", [spherical, free])
def test_what_only_spin_holds_straight_loses_by_its_lever_about_the_axis(bodies, root):
    """c = size / 2 r over ten times the first frequency, 42 at most: r from the origin, or a free craft's centre."""
    made, omega = bodies
    system = craft(made, root)
    size = np.linalg.norm(np.ptp(made["twin"].skin.points, axis=0))
    centre = np.array([[0.0, 0, 0], [1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [-3.0, 0, 1.0]])
    offset = np.array([0.05, 0.0, -0.12])  # 0.13 m
    places = (centre if root is free else 0.0 * centre) + offset
    rates = [0.0, 0.0, 20 * omega, 30 * omega]
    (said,) = watched(system, {"twin": ([0.5, 0.5, 0.08, 0.07], rates)}, places, centre)
    assert said == words("twin", "8%", 20 * omega, "over 10 times", f"{100 * size / 0.26 * 0.08**2:.1f}%")
    (said,) = watched(system, {"twin": ([0.5, 0.5, 0.03, 0.02], rates)}, places - offset, centre)
    assert said == words("twin", "3%", 20 * omega, "over 10 times", f"{100 * 42 * 0.03**2:.1f}%")
    (said,) = watched(system, {"twin": ([0.5, 0.5, 0.11, 0.09], rates)}, places + np.array([9.0, 0, 0]), centre)
    assert said == words("twin", "11%", 20 * omega, "over 10 times", f"{100 * 0.9 * 0.11**2:.1f}%")


def test_the_lever_is_that_of_the_marker_by_which_a_body_is_joined(bodies):
    made, omega = bodies
    system = craft(made, spherical)
    watch = SpunBends(SimpleNamespace(system=system))
    at = sum(system.joint_of(name).n_q + system.bodies[name].n_modes for name in system.order)
    channels = {f"bodies/{name}/rate": np.zeros((1, 3)) for name in made}
    channels |= {f"bodies/{name}/position": np.full((1, 3), 50.0) for name in made}
    channels["bodies/twin/rate"][0, 1] = 15 * omega
    channels["markers/twin.start/position"] = np.array([[0.3, 0.0, 0.4]])
    channels["markers/twin.tip/position"] = np.array([[7.0, 0.0, 0.0]])
    x = np.zeros((1, at))
    body, k = made["twin"], 0
    for name in system.order:
        k += system.joint_of(name).n_q
        if name == "twin":
            break
        k += system.bodies[name].n_modes
    size = np.linalg.norm(np.ptp(body.skin.points, axis=0))
    x[0, k] = 0.1 * size / np.linalg.norm(body.skin.shapes[0], axis=1).max()
    watch.watch(x, channels)
    with pytest.warns(PhysicsWarning, match=rf"up to about {100 * size * 0.1**2:.1f}% off"):
        watch.warn()


DEPLOYING = """
[run]
duration = "20 s"
[bodies.mast]
kind = "deploying"
family = "{family}"
length = {{ kind = "smooth_step", from = 3, to = 4, start = 0, end = 20 }}
stock = 4
mass_per_length = 0.2
{more}
[[joints]]
kind = "revolute"
child = "mast"
axis = "z"
"""
BEAM = "EIy = 20\nEIz = 30\nfunctions = { y = 2, z = 2 }\n"


@cache
def deploying(family, more):
    return system_of(parse_case(DEPLOYING.format(family=family, more=more), Path("mast.toml")), None)


@pytest.mark.parametrize(
    ("family", "more", "remedy"),
    [
        (
            "beam",
            BEAM + 'strain = "condensed"',
            "A member that deploys cannot be cut into segments: it is an indication, unless its bend stays small",
        ),
        (
            "tether",
            "functions = { y = 2, z = 2 }",
            "For none, let a universal joint turn the member about its exit, with functions.straight = false or no "
            "functions",
        ),
    ],
)
def test_a_member_that_deploys_has_the_lever_of_its_exit_and_its_own_remedy(family, more, remedy):
    system = deploying(family, more)
    watch = SpunBends(SimpleNamespace(system=system))
    body = system.bodies["mast"]
    delta = np.zeros(body.n_modes)
    delta[0] = 0.4 / abs(body.markers["tip"].phi[:, 0]).max()
    x = np.concatenate([np.zeros(system.joint_of("mast").n_q), delta, np.zeros(3 + 2 * body.n_modes)])[None]
    channels = {
        "bodies/mast/rate": np.array([[0.0, 0.0, 1e4]]),
        "bodies/mast/position": np.array([[9.0, 0, 0]]),
        "markers/mast.root/position": np.array([[0.0, 0.8, 0.6]]),
    }
    watch.watch(x, channels)
    with pytest.warns(PhysicsWarning) as given:
        watch.warn()
    (said,) = [str(one.message) for one in given]
    assert said.startswith("body 'mast', bent by 10% of its size, turned at 1e+04 rad/s, over 10 times")
    assert said.endswith(f"the bend is up to about {100 * 4.0 / 2.0 * 0.1**2:.1f}% off (limit 1%). {remedy}")


def pressed(strain, *blocks):
    """Words on a mast whose tension [N] is uniform in each row: (times, tensions, lengths)."""
    system = deploying("beam", BEAM + f'strain = "{strain}"')
    watch = AxialForceWatch(SimpleNamespace(system=system))
    n = len(system.varying["mast"].write.sections.stations)
    for times, tension, length in blocks:
        uniform = np.outer(tension, np.ones(n))
        watch.watch(np.array(times), {"bodies/mast/tension": uniform, "bodies/mast/length": np.array(length)})
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        watch.warn()
    return [str(one.message) for one in given]


def euler(length):
    return np.pi**2 * 20 / (4 * length**2)


def test_axial_forces_in_a_linear_mast_are_held_against_its_frequency_both_ways():
    """sqrt(1 + N / N_E): raised at the tautest row, lowered at the most pressed, to zero at Euler's load."""
    tail = "(limit 2%); linear strain leaves this out. Give it strain = 'condensed'"
    a, b, c, d = 0.21 * euler(3.1), -0.19 * euler(3.5), 0.05 * euler(3.6), -0.1 * euler(3.9)
    said = pressed("linear", ([1.0, 2.0], [a, d], [3.1, 3.9]), ([3.0, 4.0], [b, c], [3.5, 3.6]))
    assert said == [
        f"body 'mast' carries {a:.4g} N along its axis at t = 1 s (length 3.1 m), which raises its first frequency by "
        f"10% {tail}",
        f"body 'mast' carries {b:.4g} N along its axis at t = 3 s (length 3.5 m), which lowers its first frequency by "
        f"10% {tail}",
    ]
    low = -1.3 * euler(3.2)
    assert pressed("linear", ([5.0, 6.0], [0.0, low], [3.0, 3.2])) == [
        f"body 'mast' carries {low:.4g} N along its axis at t = 6 s (length 3.2 m), which lowers its first frequency "
        f"to zero {tail}"
    ]
    assert pressed("linear", ([5.0, 6.0], [0.038 * euler(3), -0.038 * euler(3)], [3.0, 3.0])) == []


def test_a_condensed_mast_is_warned_of_beyond_a_quarter_of_its_buckling_load():
    N = -0.62 * euler(3.7)
    said = pressed("condensed", ([1.0, 2.0], [-0.3 * euler(3.1), N], [3.1, 3.7]), ([3.0], [9 * euler(3)], [3.0]))
    assert said == [
        f"body 'mast' is compressed by {-N:.4g} N along its axis at t = 2 s (length 3.7 m): 62% of its buckling load "
        "as a cantilever of this length (limit 25%). Its deflections are sensitive to small errors, and wrong beyond "
        "buckling. Lower the load, deploy more slowly, or give it more bending stiffness"
    ]
    assert pressed("condensed", ([1.0], [-0.24 * euler(3.0)], [3.0])) == []
