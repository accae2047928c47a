"""Mechanisms with known answers: a four-bar, Andrews' squeezer, a rolling disc, a Chaplygin sleigh."""

from dataclasses import replace

import numpy as np

from femflex.body import Marker, rigid_body
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import Load, Spring, System, free, knife_edge, revolute, rolling_disc, spherical, weld


def planar(mass, inertia, center, **markers):
    """A flat body of that moment of inertia about z; markers are points in its plane."""
    J = np.diag([inertia / 2, inertia / 2, inertia])
    return rigid_body(
        mass, J, [*center, 0.0], {name: Marker.at_position([*place, 0.0]) for name, place in markers.items()}
    )


def bar(length, mass=1.0):
    """A slender bar along x with a marker at its end."""
    return rigid_body(
        mass,
        np.diag([1e-3, mass * length**2 / 12, mass * length**2 / 12]),
        [length / 2, 0, 0],
        {"end": Marker.at_position([length, 0, 0])},
    )


def four_bar(crank=0.5, coupler=2.0, rocker=1.2, base=2.0, speed=1.0, start=(0.3, 0.4, 1.6)):
    """Four bars joined by four ordinary revolute joints, three of them the tree's and one the loop."""
    ground = rigid_body(1.0, np.eye(3), markers={"pivot": Marker.at_position([base, 0, 0])})
    a, b, c = start
    return System(
        {"ground": ground, "crank": bar(crank), "coupler": bar(coupler), "rocker": bar(rocker)},
        (
            weld("ground"),
            revolute("crank", "ground", name="drive", q0=[a], u0=[speed]),
            revolute("coupler", "crank", parent_marker="end", q0=[b]),
            revolute("rocker", "ground", parent_marker="pivot", q0=[c]),
        ),
        loops=(revolute("rocker", "coupler", parent_marker="end", child_marker="end", name="closure"),),
    )


def andrews():
    """Andrews' squeezer; Mazzia and Magherini, Test Set for Initial Value Problem Solvers (2008), problem II-9."""
    d, da, e, ea, rr, ra, ss, sa, sb, sc, sd = (
        28e-3,
        115e-4,
        2e-2,
        1421e-5,
        7e-3,
        92e-5,
        35e-3,
        1874e-5,
        1043e-5,
        18e-3,
        2e-2,
    )
    ta, tb, u, ua, ub, zf, zt, fa = 2308e-5, 916e-5, 4e-2, 1228e-5, 449e-5, 2e-2, 4e-2, 1421e-5
    A, B, C = (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
    bodies = {
        "ground": planar(1.0, 1.0, (0, 0), A=A, B=B, C=C),
        "k1": planar(0.04325, 2.194e-6, (ra, 0), tip=(rr, 0)),
        "k2": planar(0.00365, 4.410e-7, (-da, 0), tip=(-d, 0)),
        "k3": planar(0.02373, 5.255e-6, (sa, sb), spring=(sd, -sc), tip=(0, -ss)),
        "k5": planar(0.07050, 1.169e-5, (ta, tb), tip=(zt, 0)),
        "k4": planar(0.00706, 5.667e-7, (0, -(e - ea)), tip=(0, -e)),
        "k7": planar(0.05498, 1.912e-5, (ua, ub), tip=(0, -u)),
        "k6": planar(0.00706, 5.667e-7, (zf - fa, 0), tip=(zf, 0)),
    }
    start = {
        "k1": -0.0617138900142764496358948458001,
        "k2": 0.0,
        "k3": 0.455279819163070380255912382449,
        "k4": 0.222668390165885884674473185609,
        "k5": 0.487364979543842550225598953530,
        "k6": -0.222668390165885884674473185609,
        "k7": 1.23054744454982119249735015568,
    }
    hung = {"k1": ("ground", "origin"), "k2": ("k1", "tip"), "k3": ("ground", "B"), "k5": ("ground", "A")}
    hung |= {"k4": ("k5", "tip"), "k7": ("ground", "A"), "k6": ("k7", "tip")}
    joints = [weld("ground")]
    joints += [revolute(k, parent, parent_marker=m, q0=[start[k]]) for k, (parent, m) in hung.items()]
    loops = [revolute(k, "k2", parent_marker="tip", child_marker="tip", name=f"to_{k}") for k in ("k3", "k4", "k6")]
    return System(
        bodies,
        tuple(joints),
        loads=(Load("drive", "k1", torque=[0, 0, 33e-3]),),
        loops=tuple(loops),
        springs=(Spring("spring", "k3", "ground", "spring", "C", stiffness=4530.0, length=7785e-5),),
    )


ANDREWS = {  # at t = 0.03 s, from the same source
    "k1": 15.8107711963,
    "k2": -15.7563710598,
    "k3": 0.0408222401,
    "k4": -0.5347301163,
    "k5": 0.5244099659,
    "k6": 0.5347301163,
    "k7": 1.0480807410,
}


def sleigh(turn, mass=2.0, inertia=0.3, ahead=0.4, constraint=None):
    """Chaplygin's sleigh in the plane: a blade at the origin, the centre of mass ahead of it, set turning in place."""
    cart = free("body", rotation="xyz", u0=[0, 0, 0, 0, 0, turn])
    return System(
        {"body": planar(mass, inertia, (ahead, 0))},
        (cart,),
        constraints=(constraint or knife_edge("blade", "body", (0, 1, 0)),),
    )


def leaning_disc(lean, spin, radius=0.5, mass=2.0, gravity=9.81):
    """A thin disc that rolls along -x on the plane z = 0 and leans by that angle."""
    turned = np.pi / 2 - lean
    q0 = [0, 0, radius * np.cos(lean), np.cos(turned / 2), np.sin(turned / 2), 0, 0]
    u0 = [-radius * spin, 0, 0, 0, 0, spin]
    body = rigid_body(mass, mass * radius**2 / 4 * np.diag([1.0, 1, 2]))
    weight = Load("weight", "disc", force=[0, 0, -mass * gravity], frame="inertial")
    return System(
        {"disc": body},
        (free("disc", q0=q0, u0=u0),),
        loads=(weight,),
        constraints=(rolling_disc("contact", "disc", radius),),
    )


def flexible_four_bar(speed=4.0, stiffness=2e3):
    """The four-bar with a slender tube for a coupler: bending in and out of the plane."""
    tube = beam_body(
        UniformBeam(length=2.0, mass_per_length=0.5, EA=1e7, EIy=stiffness, EIz=stiffness, GJ=0.75 * stiffness),
        BeamFunctions(y=3, z=2),
    )
    system = four_bar(speed=speed)
    names = {"parent_marker": "tip", "child_marker": "end"}
    return replace(
        system,
        bodies={**system.bodies, "coupler": tube},
        loops=(revolute("rocker", "coupler", name="closure", **names),),
    )


def floating_loop():
    """Three bars closed to a triangle by ordinary hinges, tumbling free, its joints sprung from corner to corner."""
    bodies = {name: bar(1.0, 1.0 + 0.5 * k) for k, name in enumerate(("base", "left", "right", "strut"))}
    joints = (
        free("base", u0=[0.1, -0.2, 0.3, 0.5, -0.4, 0.8]),
        revolute("left", "base", q0=[1.2], u0=[0.7]),
        revolute("right", "base", parent_marker="end", q0=[1.5]),
        revolute("strut", "left", parent_marker="end", q0=[-1.0]),
    )
    springs = (Spring("diagonal", "strut", "base", "end", "origin", stiffness=20.0, length=0.9),)
    closing = spherical("right", "strut", parent_marker="end", child_marker="end", name="closing")
    return System(bodies, joints, loops=(closing,), springs=springs)
