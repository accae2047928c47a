"""Which strain an extent of motion calls for, and why: every reason with its two numbers, and the limits themselves."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from femflex.advice.advice import Advice, doubt, notes_of
from femflex.advice.advise import strain_doubt
from femflex.advice.bodies import KnownBodies
from femflex.advice.buckling.margin import BucklingMargin, post_buckling_note
from femflex.advice.strain import MotionExtent, _wider, _with_buckling, growth_text, strain_of_extent
from femflex.body import rigid_body
from femflex.reduction.origin import Origin
from femflex.system import System, free


def extent(most: float = 0.0, least: float = 0.0, spin: float = 0.0, fastest: float = 0.0, **more: Any) -> MotionExtent:
    return MotionExtent(most, least, spin, fastest, **{"size": 4.0, **more})


LINEAR = {
    "at rest": (extent(), "it does not turn; no load bends it", 0.0),
    "slow": (
        extent(1e-5, -1e-5, 0.3, 0.4, bent=1e-5),
        "turning at 0.4 rad/s changes its first frequency by less than 0.005%; loads and motions bend it by less than "
        "0.005% of its size",
        0.5e-5,
    ),
    "a little spin": (
        extent(0.01, 0.0, 0.3, 0.4, bent=0.0123),
        "turning at 0.3 rad/s raises the first frequency by 0.50%; loads and motions bend it by 1.23% of its size at "
        "most",
        math.sqrt(1.01) - 1,
    ),
    "a little tension": (
        extent(0.01, 0.0, 0.0, 0.4),
        "axial tension raises the first frequency by 0.50%; no load bends it",
        math.sqrt(1.01) - 1,
    ),
    "a little compression, known in part": (
        extent(0.005, -0.01, 0.3, 0.4, bent=0.02, doubt="up to t = 3 s only"),
        "axial compression (loads or inertia) lowers the first frequency by 0.50%; loads and motions bend it by "
        "2.00% of "
        "its size at most (estimated up to t = 3 s only; the run checks it)",
        math.sqrt(1.005) - 1,
    ),
    "a phase without a swing": (
        extent(0.01, 0.0, 0.3, 0.4, phase=9.0, swing=0.9e-3),
        "turning at 0.3 rad/s raises the first frequency by 0.50%; no load bends it",
        math.sqrt(1.01) - 1,
    ),
}
CONDENSED = {
    "spin": (
        extent(0.44, -0.1, 0.3, 0.4),
        "turning at 0.3 rad/s may raise the first frequency by 20.0%, which linear strain leaves out",
        0.2,
        0.01,
    ),
    "much tension": (
        extent(8.0, 0.0, 0.0, 0.4),
        "axial tension may raise the first frequency 3-fold, which linear strain leaves out",
        2.0,
        0.01,
    ),
    "compression": (
        extent(0.21, -0.36, 0.3, 0.4),
        "axial compression (loads or inertia) may lower the first frequency by 20.0%, which linear strain leaves out",
        0.2,
        0.01,
    ),
    "buckling": (
        extent(0.0, -1.3, 0.3, 0.4),
        "axial compression (loads or inertia) may buckle it in its first mode, which linear strain leaves out",
        1.0,
        0.01,
    ),
    "a bend": (
        extent(bent=0.062, start=0.04),
        "loads and motions may bend it by 6.2% of its size of 4 m (limit 5%; linear strain is valid up to about 10%)",
        0.062,
        0.05,
    ),
    "a bend at the start": (
        extent(bent=0.062, start=0.061),
        "its initial deflection is 6.1% of its size of 4 m (limit 5%; linear strain is valid up to about 10%)",
        0.062,
        0.05,
    ),
    "a far bend": (
        extent(bent=0.31, dividing="divide it"),
        "loads and motions may bend it by 31.0% of its size of 4 m (limit 5%; linear strain is valid up to about 10%); "
        "the estimated deflection is 31% of its size, and condensed strain is valid up to about 20%. If the run "
        "confirms "
        "it, divide it",
        0.31,
        0.05,
    ),
    "stretch between supports": (
        extent(bent=0.01, stretched=0.44),
        "loads and motions may bend it by 0.04 m. Stretching between its supports, which linear strain leaves "
        "out, then "
        "adds 44% to the restoring force of its first mode",
        0.2,
        0.01,
    ),
    "phase": (
        extent(0.01, -0.016, 0.3, 0.4, phase=0.062, swing=1.1e-3),
        "axial forces, which linear strain leaves out, change its first frequency by at most 0.80%. Its "
        "vibration would "
        "be out of phase by 0.062 rad at the end of the run (limit 0.05 rad)",
        0.062,
        0.05,
    ),
}


@pytest.mark.parametrize("case", LINEAR)
def test_linear_strain_is_enough_for_a_reason(case: str):
    reach, words, value = LINEAR[case]
    found = strain_of_extent("boom", reach)
    assert (found.body, found.decision, found.choice, found.reason) == ("boom", "strain", "linear", words)
    assert found.value == pytest.approx(value, abs=1e-9) and found.limit == pytest.approx(0.01)
    assert found.text == f"strain is linear: {words}" and not found.doubt


@pytest.mark.parametrize("case", CONDENSED)
def test_condensed_strain_is_called_for_with_both_numbers(case: str):
    reach, words, value, limit = CONDENSED[case]
    found = strain_of_extent("boom", reach)
    assert (found.choice, found.reason) == ("condensed", words)
    assert (found.value, found.limit) == pytest.approx((value, limit))
    assert found.text == f"strain is condensed: {words} (set strain = 'linear' for linear strain)"


@pytest.mark.parametrize(
    "reach",
    [
        lambda f: extent(most=(1 + 0.01 * f) ** 2 - 1),
        lambda f: extent(least=(1 - 0.01 * f) ** 2 - 1),
        lambda f: extent(bent=0.05 * f),
        lambda f: extent(stretched=(1 + 0.01 * f) ** 2 - 1),
        lambda f: extent(phase=0.05 * f, swing=0.01),
        lambda f: extent(phase=1.0, swing=1e-3 * f),
    ],
)
def test_each_limit_is_where_it_is_said_to_be(reach):
    assert (
        strain_of_extent("a", reach(0.99)).choice == "linear"
        and strain_of_extent("a", reach(1.01)).choice == "condensed"
    )


def test_a_word_on_far_bends_is_said_beyond_a_fifth_of_the_size():
    for bent, told in ((0.199, False), (0.201, True)):
        assert ("valid up to about 20%" in strain_of_extent("a", extent(most=1.0, bent=bent)).reason) == told


def test_growth_is_said_in_per_cent_up_to_twice():
    assert [growth_text(g) for g in (0.999, 1.0, 2.5)] == ["by 99.9%", "2-fold", "3.5-fold"]


def test_the_wider_of_two_extents_has_the_extremes_of_both():
    a = extent(0.3, -0.2, 1.0, 2.0, bent=0.1, phase=0.4)
    assert _wider(a, extent(0.5, -0.1, 5.0, 1.5)) == extent(0.5, -0.2, 5.0, 2.0, bent=0.1, phase=0.4)
    assert _wider(a, extent(0.2, -0.6, 5.0, 6.0)) == extent(0.3, -0.6, 1.0, 6.0, bent=0.1, phase=0.4)
    assert _wider(a, extent(0.3, -0.2, 5.0, 2.0)) == a


def margin(part: float, flutters: bool = False) -> BucklingMargin:
    return BucklingMargin("load 'p' (3 N)", part, flutters, "a 0.2, b 0.1")


def test_a_load_near_buckling_decides_on_the_strain():
    linear, condensed = strain_of_extent("b", extent()), strain_of_extent("b", extent(most=0.44))
    assert _with_buckling(linear, None) is linear
    found = _with_buckling(linear, margin(0.3))
    words = "load 'p' (3 N) is 0.3 of the linear buckling load (a 0.2, b 0.1), which linear strain leaves out"
    assert (found.choice, found.reason, found.value, found.limit) == ("condensed", words, 0.3, 0.8)
    assert _with_buckling(condensed, margin(0.3)) is condensed
    followed = _with_buckling(condensed, margin(0.3, True))
    assert followed.choice == "condensed" and "is 0.3 of the flutter load (a 0.2, b 0.1), which" in followed.reason
    near = _with_buckling(condensed, margin(0.85))
    assert (near.choice, near.value, near.limit, near.reason) == (
        "nonlinear",
        0.85,
        0.8,
        words.replace("0.3 of", "0.85 of"),
    )
    past = _with_buckling(linear, margin(1.1))
    assert past.reason == words.replace("0.3 of", "1.1 of") + (
        "; 1.3 % past its buckling load a column deflects by 20% of its length, the limit of nonlinear strain in one "
        "body: cut the member into segments"
    )
    assert (_with_buckling(linear, margin(0.8)).choice, _with_buckling(linear, margin(0.79)).choice) == (
        "nonlinear",
        "condensed",
    )


@pytest.mark.parametrize(
    ("part", "flutters", "form", "start"),
    [
        (0.89, False, "condensed", ""),
        (0.9, False, "condensed", "; above 0.9 of it, condensed strain gives too small"),
        (0.99, False, "nonlinear", ""),
        (1.0, False, "nonlinear", "; 1.3 % past its buckling load"),
        (0.99, True, "condensed", ""),
        (1.0, True, "nonlinear", "; past flutter the oscillation grows"),
        (2.0, False, "linear", ""),
    ],
)
def test_what_a_form_of_strain_misses_near_buckling_is_said_from_its_limit_on(part, flutters, form, start):
    found = post_buckling_note(margin(part, flutters), form)
    assert found.startswith(start) and bool(found) == bool(start)


def test_a_margin_reads_without_shares_where_one_load_is_to_blame():
    assert str(BucklingMargin("its total load", 0.25678)) == "its total load is 0.257 of the linear buckling load"


def test_a_linear_body_that_wants_another_strain_is_a_doubt_with_both_remedies():
    system = System(
        {"hub": rigid_body(1.0, np.eye(3)), "boom": rigid_body(1.0, np.eye(3))}, (free("hub"), free("boom"))
    )
    known = KnownBodies({"boom": Origin(remedy="do this")})
    wanted = Advice("boom", "strain", "condensed", "why", 0.3, 0.2)
    found = strain_doubt(system, known, wanted)
    assert found.reason == (
        "body 'boom' has linear strain: why. To follow it, do this, or divide it into several bodies, welded to "
        "each other"
    )
    assert found.doubt and (found.choice, found.value, found.limit) == ("condensed", 0.3, 0.2)
    plain = Advice("boom", "strain", "linear", "why")
    assert strain_doubt(system, known, plain) is plain
    assert known.remedy("hub") == "give it strain = 'condensed'" and known.open("hub") == Origin().open


def test_notes_join_what_was_chosen_of_a_body():
    one = [
        Advice("a", "strain", "linear", "x"),
        Advice("", "craft", None, "y"),
        Advice("a", "shapes", None, "z"),
        Advice("a", "joints", {}, "w"),
        doubt("a", "bend", "v"),
        Advice("b", "buckling", None, "u"),
    ]
    assert notes_of(one) == {"a": "strain is linear: x; z", "b": "u"}
