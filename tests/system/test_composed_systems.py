"""Systems made of parts: bodies cut into segments, initial states handed on, names and summaries."""

from __future__ import annotations

import numpy as np
import pytest
from support.random_systems import random_body, random_tree

from femflex.body import Marker, rigid_body
from femflex.system import (
    Controller,
    Effector,
    Friction,
    Latch,
    Load,
    Orbit,
    Segments,
    Sight,
    Spring,
    System,
    Variation,
    assembled,
    free,
    knife_edge,
    revolute,
    spherical,
    started,
    universal,
    weld,
)
from femflex.system.segments import carrier, marker_label, segment_name, with_carrier


def segment(k: int, *markers: str):
    named = {name: Marker.rigid(np.array([k + 0.1 * j, 0.0, 1.0])) for j, name in enumerate(markers)}
    ends = {".near": Marker.rigid(np.array([1.0 * k, 0, 0])), ".far": Marker.rigid(np.array([k + 1.0, 0, 0]))}
    return rigid_body(1.0 + k, [1.0, 1.0, 1.0], markers=named | ends)


BOOM = Segments((segment(0, "root"), segment(1, "lug"), segment(2, "mid"), segment(3, "tip")))
HUB = rigid_body(9.0, [1.0, 1.0, 1.0], markers={"m": Marker.rigid(np.zeros(3))})


def idle(*_):
    pass


def craft(**more) -> System:
    joints = (
        free("hub"),
        weld("boom", "hub", child_marker="mid", parent_marker="m"),
        revolute("flap", "boom", parent_marker="tip", name="hinge"),
    )
    return assembled({"hub": HUB, "boom": BOOM, "flap": HUB}, joints, **more)


def test_segments_are_welded_outwards_from_the_one_that_is_held():
    system = craft()
    assert system.segments == {"boom": ("boom.1", "boom.2", "boom.3", "boom.4")}
    found = {j.child: (j.parent, j.parent_marker, j.child_marker, j.label) for j in system.joints}
    assert found["boom.3"] == ("hub", "m", "mid", "hub-boom")
    assert found["boom.4"][:3] == ("boom.3", ".far", ".near")
    assert found["boom.2"][:3] == ("boom.3", ".near", ".far") and found["boom.1"][:3] == ("boom.2", ".near", ".far")
    assert found["flap"] == ("boom.4", "tip", "origin", "hinge")
    assert [system.bodies[f"boom.{k + 1}"].moments.mass for k in range(4)] == [1.0, 2.0, 3.0, 4.0]
    whole = assembled({"hub": HUB, "boom": BOOM}, (free("hub"), weld("boom", "hub", name="w")))
    assert whole.joint_of("boom.1").label == "w" and whole.joint_of("boom.4").parent == "boom.3"


def test_what_acts_on_a_cut_body_goes_to_the_segment_with_its_marker():
    law = Controller("law", lambda t, s, m: (np.zeros(1), m), 0.5, commands={"u": "N"})
    system = craft(
        loads=(Load("a", "boom", "lug"), Load("b", "hub", "m"), Load("c", "boom")),
        loops=(revolute("boom", "hub", child_marker="tip", parent_marker="m"),),
        springs=(Spring("s", "hub", "boom", parent_marker="lug"), Spring("t", "boom", None, marker="tip")),
        constraints=(knife_edge("e", "boom", [1, 0, 0], marker="root", parent="boom", parent_marker="tip"),),
        effectors=(Effector("f", idle, (("hub", "m"), ("boom", "mid"), ("boom", "origin"))), law, Effector("g", idle)),
    )
    assert [(load.body, load.marker) for load in system.loads] == [
        ("boom.2", "lug"),
        ("hub", "m"),
        ("boom.1", "origin"),
    ]
    (loop,) = system.loops
    assert (loop.child, loop.parent, loop.label) == ("boom.4", "hub", "hub-boom")
    assert [(s.body, s.parent) for s in system.springs] == [("hub", "boom.2"), ("boom.4", None)]
    assert (system.constraints[0].body, system.constraints[0].parent) == ("boom.1", "boom.4")
    assert system.effectors[0].markers == (("hub", "m"), ("boom.3", "mid"), ("boom.1", "origin"))
    assert system.effectors[1] is law
    joints = (spherical("hub"), weld("boom", "hub"))
    sight = Sight("s", "boom", "tip")
    looking = assembled({"hub": HUB, "boom": BOOM}, joints, orbit=Orbit(7e6), sights=(sight,))
    assert looking.sights[0].body == "boom.4"


def test_markers_and_bodies_of_a_cut_body_are_found_and_exchanged():
    assert [BOOM.holder(name) for name in ("origin", "root", "lug", "mid", "tip")] == [0, 0, 1, 2, 3]
    assert set(BOOM.markers) == {"origin", "root", "lug", "mid", "tip"}
    assert BOOM.marker("tip").position[0] == 3.0 and BOOM.markers["origin"] is BOOM.bodies[0].markers["origin"]
    with pytest.raises(KeyError) as error:
        BOOM.holder("end")
    assert "'end' is not on the body; its markers are ['lug', 'mid', 'origin', 'root', 'tip']" in str(error.value)
    other = with_carrier(BOOM, "mid", segment(7, "mid"))
    assert [body.moments.mass for body in other.bodies] == [1.0, 2.0, 8.0, 4.0]
    assert carrier(BOOM, "mid").moments.mass == 3.0
    assert carrier(HUB, "m") is HUB and with_carrier(HUB, "m", BOOM.bodies[0]) is BOOM.bodies[0]
    assert segment_name("boom", 2) == "boom.3"
    names = {"mast": ("mast.1",), "boom": ("boom.1", "boom.2")}
    assert marker_label(names, "boom.2", "tip") == "boom.tip" and marker_label(names, "hub", "m") == "hub.m"


@pytest.mark.parametrize("seed", range(4))
def test_a_system_started_in_a_state_begins_there(seed):
    system, _, (q, u) = random_tree(seed, n_bodies=6)
    names = [name for name, _ in system.coordinate_names()]
    x = np.concatenate([q, u])
    found = started(system, x)
    np.testing.assert_allclose(found.initial_state(), x)
    for name in system.order:
        own = [k for k, other in enumerate(names) if other.startswith(f"{name}.delta")]
        np.testing.assert_allclose(found.delta0[name], q[own])


def many_states() -> System:
    latches = (Latch(0, at=1.0), Latch(1, at=-1.0))
    joints = (free("hub"), universal("arm", "hub", name="u", latches=latches))
    jet = Effector("jet", idle, states={"m": "kg", "s": "1"}, z0=[3.0, 0.5], sizes=[2.0, 0.1])
    law = Controller(
        "law", lambda t, s, m: (np.zeros(1), m), 0.5, commands={"v": "N"}, memory=[7.0, 8.0], held=[0.3], start=1.5
    )
    return System({"hub": HUB, "arm": HUB}, joints, effectors=(jet, law), z0={"jet.s": 0.25, "law.memory2": 9.0})


def test_states_stand_in_the_order_of_their_owners_with_their_own_values_and_sizes():
    system = many_states()
    names = [
        ("u.latch1_time", "s"), ("u.latch1_loss", "J"), ("u.latch2_time", "s"), ("u.latch2_loss", "J"),
        ("jet.m", "kg"), ("jet.s", "1"), ("law.v", "N"), ("law.memory1", "1"), ("law.memory2", "1"), ("law.next", "s"),
    ]  # fmt: skip
    assert system.state_names() == names and system.all_state_names()[-10:] == names
    np.testing.assert_array_equal(system.initial_state()[-10:], [-1, 0, -1, 0, 3.0, 0.25, 0.3, 7.0, 9.0, 1.5])
    np.testing.assert_array_equal(system.state_sizes(), [1, 1, 1, 1, 2.0, 0.1, 1, 1, 1, 1])
    x = np.arange(1.0, len(system.initial_state()) + 1)
    x[3:7] = [0.5, 0.5, 0.5, 0.5]
    np.testing.assert_array_equal(started(system, x).initial_state(), x)
    assert [one.name for one in system.controllers] == ["law"] and system.controllers[0].instant(4) == 3.5


def test_parents_stand_before_children_by_their_depth_then_as_given():
    bodies = dict.fromkeys(("e", "d", "c", "b", "a"), HUB)
    joints = (weld("b", "a"), weld("e", "b"), weld("d", "a"), free("c"), free("a"))
    system = System(bodies, joints)
    assert system.order == ["c", "a", "d", "b", "e"] and system.root == "c"
    assert system.joint_of("e").parent == "b"


def test_a_summary_counts_all_that_the_system_has():
    soft, _ = random_body(np.random.default_rng(1), 3)
    system = System(
        {"hub": HUB, "arm": soft},
        (spherical("hub"), revolute("arm", "hub", name="hinge", laws=(Friction(limit=1.0),))),
        orbit=Orbit(7e6), loads=(Load("p", "hub"), Load("q", "hub")), springs=(Spring("s", "hub", "arm"),),
        loops=(revolute("arm", "hub", name="cut"),), effectors=(Effector("f", idle),),
        varying={"arm": Variation(idle, ("mass",))},
    )  # fmt: skip
    title, rows = system.summary()
    found = dict(rows)
    assert title == "System" and found["bodies"] == "2: hub, arm" and found["joints"] == "base-hub, hinge"
    assert (
        found["mass"] == f"{9.0 + soft.moments.mass:.6g} kg" and found["degrees of freedom"] == "7, 3 of them elastic"
    )
    assert (found["loads"], found["springs"], found["loops"], found["effectors"]) == ("p, q", "s", "cut", "f")
    period = 2 * np.pi * np.sqrt(7e6**3 / 3.986004418e14)
    assert found["orbit"] == f"specified, period {period:.6g} s" and found["varying bodies"] == "arm"
    assert found["frame"] == "inertial" and "constraints" not in found
    loose = dict(System({"hub": HUB}, (free("hub"),), orbit=Orbit(7e6, free=True)).summary()[1])
    assert loose["orbit"].startswith("free, period") and "varying bodies" not in loose


def test_a_law_of_no_place_and_a_name_that_is_none_are_told():
    with pytest.raises(ValueError, match="the name 'a b' of a body"):
        System({"hub": HUB}, (free("hub"),), segments={"a b": ("hub",)})
    for what, more in (
        ("effector", {"effectors": (Effector("a b", idle),)}),
        ("spring", {"springs": (Spring("a b", "hub"),)}),
        ("constraint", {"constraints": (knife_edge("a b", "hub", [1, 0, 0]),)}),
        ("law", {"joints": (free("hub", laws=(Friction(0, "a b", limit=1.0),)),)}),
        ("joint or loop", {"loops": (revolute("hub", name="a b"),)}),
        ("sight", {"sights": (Sight("a b", "hub"),), "orbit": Orbit(7e6), "joints": (spherical("hub"),)}),
    ):
        with pytest.raises(ValueError, match=f"found the name 'a b' of a {what}; a name holds"):
            System(**({"bodies": {"hub": HUB}, "joints": (free("hub"),)} | more))
    with pytest.raises(ValueError, match=r"found the names 'boom' and 'boom.tip' of two of the bodies"):
        System({"boom": HUB, "boom.tip": HUB}, (free("boom"), weld("boom.tip", "boom", name="w")))
    with pytest.raises(ValueError, match=r"found the names 'w' and 'w.x' of two of the joints"):
        System({"a": HUB, "b": HUB}, (free("a", name="w"), weld("b", "a", name="w.x")))
