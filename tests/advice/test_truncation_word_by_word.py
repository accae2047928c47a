"""What is said of craft whose bodies have too few shapes, against beams with tip masses solved by their equations."""

from __future__ import annotations

import re
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

import femflex.advice.truncation as module
from femflex.advice.bodies import KnownBodies
from femflex.advice.enriched_bodies import EnrichedBody
from femflex.advice.truncation import (
    RicherCraft,
    joint_advice,
    richer_craft,
    truncation_warnings,
    unassessed_truncation,
)
from femflex.body import FlexibleBody, MassMoments, StrainTensors, rigid_body
from femflex.reduction.admissible import beam_body
from femflex.reduction.beams.uniform_beam import BeamFunctions, UniformBeam
from femflex.reduction.origin import Analytic, LeftOpen, Origin
from femflex.system import System, weld
from femflex.warning import TruncationWarning

SOFT = UniformBeam(length=2.0, EA=1e5, EIy=3.0, EIz=5.0, GJ=1.0, mass_per_length=0.4)
HARD = UniformBeam(length=1.5, EA=1e5, EIy=300.0, EIz=500.0, GJ=100.0, mass_per_length=0.4)
TIP = 3.0  # kg
POOR, RICH = BeamFunctions(1, 1), BeamFunctions(3, 3, family="polynomial")


@cache
def craft() -> tuple[System, KnownBodies]:
    made = {"poor": (SOFT, POOR), "rich": (HARD, RICH)}
    bodies = {name: beam_body(beam, functions) for name, (beam, functions) in made.items()}
    point = rigid_body(TIP, 1e-9 * np.eye(3))
    joints = (
        weld("base"),
        weld("poor", "base", child_marker="root"),
        weld("load", "poor", parent_marker="tip"),
        weld("rich", "base", child_marker="root"),
        weld("mass", "rich", parent_marker="tip"),
    )
    system = System({"base": rigid_body(1.0, np.eye(3)), **bodies, "load": point, "mass": point}, joints)
    known = {name: Origin(Analytic(*pair)) for name, pair in made.items()}
    return system, KnownBodies(known)


def exact(beam: UniformBeam, EI: float) -> float:
    """First frequency [Hz] of a cantilever with a point mass at its tip."""
    ratio = TIP / (beam.mass_per_length * beam.length)
    b = brentq(
        lambda b: 1 + np.cos(b) * np.cosh(b) + ratio * b * (np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b)), 0.1, 1.8
    )
    return b**2 * np.sqrt(EI / (beam.mass_per_length * beam.length**4)) / (2 * np.pi)


def one_mode(beam: UniformBeam, EI: float) -> float:
    """The same with the first mode of the bare cantilever alone: 2 at the tip, for a mean square of 1 [Hz]."""
    mass = beam.mass_per_length * beam.length
    stiffness = 1.87510406871196**4 * EI / beam.length**3
    return np.sqrt(stiffness / (mass + 4 * TIP)) / (2 * np.pi)


JUDGED = "the first 3 and those below 0.75 Hz, lengths of t = 12.5 s"
SAID = re.compile(
    r"the craft's elastic frequencies \((?P<judged>.*), at rest, with linear strain\) "
    r"change by more than 1% with richer "
    r"sets of shapes: 1 at (?P<a>\S+) Hz would be at (?P<b>\S+) Hz \(-(?P<c>\S+)%\), 2 at (?P<d>\S+) Hz would be at "
    r"(?P<e>\S+) Hz \(-(?P<f>\S+)%\)\. Raise the number of modes of (?P<named>.*), or give the body more static shapes "
    r"\(`joints`\)\. The richer sets contain all static shapes of the joints and their dynamic \(inertia\) corrections"
)


def test_frequencies_that_richer_sets_would_lower_are_said_with_the_body_that_lacks_shapes():
    system, known = craft()
    richer = richer_craft(system, known)
    assert set(richer.bodies) == {"poor", "rich"} and richer.still == {"poor", "rich"} and richer.lack == ""
    assert richer.markers == {
        "base": ("origin",),
        "poor": ("root", "tip"),
        "load": ("origin",),
        "rich": ("root", "tip"),
        "mass": ("origin",),
    }
    (found,) = truncation_warnings(system, richer, 0.75, 12.5)
    assert (found.body, found.decision, found.choice, found.doubt) == ("", "truncation", None, True)
    assert found.category is TruncationWarning and found.limit == 0.01
    said = SAID.fullmatch(found.reason)
    assert said and said["judged"] == JUDGED and said["named"] == "'poor'"
    for EI, (kept, better, change) in ((3.0, "abc"), (5.0, "def")):
        assert float(said[kept]) == pytest.approx(one_mode(SOFT, EI), rel=1e-3)
        assert float(said[better]) == pytest.approx(exact(SOFT, EI), rel=1.5e-3)
        assert float(said[change]) == pytest.approx(100 * (1 - exact(SOFT, EI) / one_mode(SOFT, EI)), abs=0.12)
    assert found.value == pytest.approx(1 - exact(SOFT, 3.0) / one_mode(SOFT, 3.0), abs=5e-4)
    assert truncation_warnings(system, RicherCraft({}), 0.0) == []


def test_sets_that_hold_their_modes_are_not_warned_of():
    system, known = craft()
    joints = [joint for joint in system.joints if joint.child in ("base", "rich", "mass")]
    alone = System({name: system.bodies[name] for name in ("base", "rich", "mass")}, tuple(joints))
    assert truncation_warnings(alone, richer_craft(alone, KnownBodies({"rich": known["rich"].origin})), 0.0) == []


def test_a_craft_of_too_many_coordinates_or_one_that_fails_has_no_richer_sets_and_says_why(monkeypatch):
    """Beams get 8 polynomials more in each field that has functions: 2 (3 + 8); those not known keep their two."""
    system, known = craft()
    half = KnownBodies({"rich": known["rich"].origin})
    monkeypatch.setattr(module, "MANY_RICHER", 23)
    assert richer_craft(system, half).lack == "24 coordinates with richer sets, over 23"
    monkeypatch.setattr(module, "MANY_RICHER", 24)
    assert richer_craft(system, half).lack == ""
    nothing = richer_craft(system, KnownBodies({}))
    assert (nothing.bodies, nothing.modes, nothing.lack) == ({}, None, "")

    def fails(body, markers):
        raise ValueError("the set is no set.\nAnd more.")

    broken = richer_craft(system, {"poor": SimpleNamespace(enriched=fails)})
    assert broken.lack == "the set is no set" and broken.modes is None and not broken.bodies


def test_bodies_alike_are_enriched_once_for_each_set_of_their_joints():
    system, _ = craft()
    calls = []
    one = SimpleNamespace(enriched=lambda body, markers: calls.append((body, markers)))
    joints = (*system.joints, weld("twin", "base", child_marker="root"), weld("third", "base", child_marker="root"))
    bodies = {**system.bodies, "twin": system.bodies["poor"], "third": system.bodies["poor"]}
    known = {name: one for name in ("poor", "twin", "third", "base")}
    assert richer_craft(System(bodies, joints), known).lack == ""
    assert [markers for _, markers in calls] == [("root", "tip"), ("root",)]


def test_bodies_whose_sets_are_not_assessed_are_noted_with_the_reason():
    system, known = craft()
    preloaded = SimpleNamespace(origin=known["rich"].origin, is_preloaded=True)
    file = SimpleNamespace(origin=Origin(None), is_preloaded=False)
    words = {"rich": "its modes are computed about its preload", "poor": "its file has no elements"}
    found = unassessed_truncation(system, {"poor": file, "rich": preloaded, "base": file}, RicherCraft({}, lack="why"))
    assert [(one.body, one.decision, one.doubt) for one in found] == [
        ("poor", "truncation", False),
        ("rich", "truncation", False),
    ]
    for one in found:
        head = "the truncation error of the craft's frequencies is not estimated for it"
        assert one.reason == f"{head} ({words[one.body]})"
    (said,) = unassessed_truncation(system, {"rich": known["rich"]}, RicherCraft({}, lack="600 of them"))
    assert said.reason.endswith("not estimated for it (600 of them)") and said.body == "rich"
    assert unassessed_truncation(system, {"rich": known["rich"]}, RicherCraft({})) == []


def enriched(stiffness: list[float], *places: tuple[str, str]) -> EnrichedBody:
    """Springs in a row, the first of which is kept, and one static shape for each of the others."""
    n = len(stiffness)
    moments = MassMoments(1.0, np.zeros((1 + n, 3)), np.zeros((1 + n, 3, 1 + n, 3)))
    body = FlexibleBody(moments, StrainTensors.linear(np.diag(stiffness)), np.zeros((n, n)), {})
    choices = {place: np.eye(n)[:, [k + 1]] for k, place in enumerate(places)}
    return EnrichedBody(body, np.eye(n)[:, [0]], choices)


def test_joints_get_the_shapes_that_any_length_of_the_craft_wants_and_bodies_alike_get_the_same():
    places = (("tip", "z"), ("tip", "x"), ("tip", "ry"), ("root", "y"), ("root", "rx"))
    one = enriched([1.0, 4.0, 9.0, 16.0, 25.0, 36.0], *places)
    omega = np.array([0.0, 2.0, 5.0, 7.0])
    served = np.array([1, 3])

    def modes(**motions):
        shapes = {name: np.array(rows, float).T * omega for name, rows in motions.items()}
        return SimpleNamespace(shapes=shapes, omega=omega, lowest_elastic=lambda count, band: served)

    still = [0.0] * 6
    tip_z, tip_ry = [0, 0.2, 0, 0, 0, 0], [0, 0, 0, 0.1, 0, 0]
    root_y, tip_x = [0, 0, 0, 0, 0.1, 0], [0, 0, 0.1, 0, 0, 0]
    first = RicherCraft(
        {"a": one, "b": one, "c": one},
        modes(a=[still, tip_z, tip_x, still], b=[still, still, still, tip_ry], c=[still, root_y, still, root_y]),
        {"a": ("root", "tip"), "b": ("root", "tip"), "c": ("root",)},
        frozenset("c"),
    )
    second = RicherCraft({"a": one}, modes(a=[still, still, still, root_y]), {"a": ("root", "tip")}, frozenset())
    none = RicherCraft({}, None, lack="no")
    free_, bound = LeftOpen(at_roots=True, elsewhere=True, roots=("root",)), LeftOpen(roots=("root",), elsewhere=True)
    known = KnownBodies({name: Origin(None, free_) for name in "abc"})
    found = joint_advice([first, none, second], known, {"a": "same", "b": "same", "c": "same", "d": "other"}, 0.0)
    assert {name: one.choice for name, one in found.items()} == {
        "a": {"root": ["y"], "tip": ["z", "ry"]},
        "b": {"root": ["y"], "tip": ["z", "ry"]},
        "c": {},
        "d": {},
    }
    head = "static shapes of its joints that the modes of the craft need: "
    assert found["a"].reason == head + "root y, tip z ry" and found["c"].reason == head + "none"
    assert all((one.body, one.decision, one.limit) == (name, "joints", 1e-3) for name, one in found.items())
    closed = KnownBodies({name: Origin(None, bound) for name in "abc"})
    assert joint_advice([first, second], closed, {"a": "same"}, 0.0)["a"].choice == {"tip": ["z"]}
