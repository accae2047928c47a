"""What a System refuses, each in a sentence."""

import numpy as np
import pytest

from femflex.body import Marker, rigid_body
from femflex.system import Frame, Joint, Load, Orbit, System, free, prismatic, revolute, spherical, weld


def hub(**markers):
    return rigid_body(1.0, np.eye(3), markers={name: Marker.rigid(np.zeros(3)) for name in markers})


BODIES = {"hub": hub(mount=0), "arm": hub()}
ROOT = free("hub")


@pytest.mark.parametrize(
    ("bodies", "joints", "more", "sentence"),
    [
        ({}, (), {}, "the system has no bodies"),
        (BODIES, (ROOT,), {}, "body 'arm' has no joint"),
        (
            BODIES,
            (ROOT, weld("leg", "hub")),
            {},
            r"child 'leg' of joint 'hub-leg' is not a body; bodies are \['arm', 'hub'\]",
        ),
        (BODIES, (ROOT, weld("arm", "arm")), {}, "joins body 'arm' to itself"),
        (BODIES, (ROOT, weld("arm", "hub"), weld("arm", "hub")), {}, "body 'arm' is the child of two joints"),
        (BODIES, (weld("hub", "arm"), weld("arm", "hub")), {}, "the tree of joints is cyclic: arm -> hub -> arm"),
        (
            BODIES,
            (ROOT, weld("arm", "hub", parent_marker="tip")),
            {},
            r"marker 'tip' of joint 'hub-arm' is not on body 'hub'; its markers are \['mount', 'origin'\]",
        ),
        (
            BODIES,
            (ROOT, weld("arm", "hub")),
            {"loads": (Load("push", "leg"),)},
            "body 'leg' of load 'push' does not exist",
        ),
        (
            BODIES,
            (ROOT, weld("arm", "hub")),
            {"delta0": {"arm": np.ones(2)}},
            r"delta0 of body 'arm' has shape \(2,\); expected \(0,\)",
        ),
        (BODIES, (ROOT, weld("arm", "hub")), {"frame": Frame("orbital")}, "the orbital frame needs an orbit"),
        (
            BODIES,
            (ROOT, weld("arm", "hub")),
            {"orbit": Orbit(7e6)},
            "a specified orbit eliminates the root's translation",
        ),
        (
            BODIES,
            (spherical("hub"), weld("arm", "hub")),
            {"orbit": Orbit(7e6, free=True)},
            "a free orbit needs a free root joint; joint 'base-hub' has 0 translations",
        ),
        (BODIES, (spherical("hub"), spherical("arm")), {"orbit": Orbit(7e6)}, "an orbiting system has one root body"),
    ],
)
def test_impossible_systems_are_refused(bodies, joints, more, sentence):
    with pytest.raises(ValueError, match=sentence):
        System(bodies, joints, **more)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: revolute("arm", axis=(0, 0, 0)), "a rotation axis of joint 'base-arm' has no direction"),
        (lambda: prismatic("arm", stiffness=-1.0), "stiffness of joint 'base-arm' is negative"),
        (lambda: spherical("arm", rotation="abc"), "rotation set 'abc' of joint 'base-arm' is not known; known are"),
        (lambda: free("arm", u0=np.ones(3)), "u0 of joint 'base-arm' has 3 values; the joint needs 6"),
        (
            lambda: Joint("arm", translations=np.ones((2, 3))),
            "translation axes of joint 'base-arm' depend on each other",
        ),
        (lambda: Joint("arm", rotations=np.eye(3)[:1], ball="xyz"), "has both a ball and turning axes"),
        (lambda: Orbit(7e6, 1.2), "eccentricity is 1.2"),
        (lambda: Orbit(-7e6), "must both be positive"),
        (lambda: Frame("lunar"), "frame 'lunar' is not known"),
        (lambda: Load("push", "hub", frame="lunar"), "frame 'lunar' of load 'push' is not known"),
        (lambda: Load("push", "hub", force=np.ones(2)), r"force of load 'push' has shape \(2,\); expected \(3,\)"),
        (
            lambda: Load("push", "hub", force=np.full(3, np.nan)),
            "force of load 'push' holds a value that is not finite",
        ),
        (
            lambda: Load("push", "hub", force=np.ones((2, 3)), times=np.array([1.0, 0.0])),
            "times of load 'push' must be finite, at least two, and not decreasing",
        ),
    ],
)
def test_impossible_parts_are_refused(make, sentence):
    with pytest.raises(ValueError, match=sentence):
        make()


def test_parents_come_before_children_in_any_numbering():
    bodies = {name: hub() for name in ("c", "b", "a")}
    system = System(bodies, (weld("c", "b"), revolute("b", "a"), free("a")))
    assert system.order == ["a", "b", "c"]
    assert system.root == "a"
    names = [name for name, _ in system.coordinate_names()]
    assert names[:3] == ["base-a.slide1", "base-a.slide2", "base-a.slide3"] and names[-1] == "a-b.angle"
