"""Bodies get the strain that was advised, or else the other one that is not linear, or stay linear; each with why."""

from __future__ import annotations

from typing import Any

import pytest

from femflex.advice.advice import Advice
from femflex.advice.bodies import KnownBodies
from femflex.assembly.open_choices import open_choices
from femflex.case import parse_case, read_case
from femflex.pipeline.chosen_strains import bodies_that_stretch
from femflex.pipeline.decisions import decided
from femflex.reduction.origin import Origin

CONDENSED = 'method = "cantilever", clamp = "ROOT", modes = 2'
LUMPED = 'method = "lumped", clamp = "ROOT"'  # it has no derivatives, which the condensed form needs
NEITHER = 'method = "cantilever", clamp = "ROOT", modes = 2, derivatives = 3, third_derivatives = 9'


def advised(write_case: Any, craft: str, reductions: dict[str, str], wanted: dict[str, str], bound: str = "") -> Any:
    """The answer for booms with these reductions of which these strains are wanted, "it bends"."""
    start, end = craft.index("[bodies.boom]"), craft.index("[[joints]]")
    boom, weld = craft[start:end], craft[end : craft.index("[[loads]]")]
    tables = [
        boom.replace('method = "cantilever", clamp = "ROOT", modes = 4', own).replace("boom]", f"{name}]")
        + weld.replace('"boom"', f'"{name}"')
        for name, own in reductions.items()
    ]
    case = read_case(write_case("".join([craft[:start], *tables])))
    origins = {bound: Origin(None, open_choices(case.bodies[bound]), "with some key it is bound")} if bound else {}
    advice = {name: Advice(name, "strain", choice, f"{name} bends", 0.3, 0.1) for name, choice in wanted.items()}
    system: Any = None  # it is asked for the loads of curved bodies alone
    same, built, found = bodies_that_stretch(case, system, KnownBodies(origins), advice, [])
    assert same is case and {name: one.part.strain_form for name, one in built.items()} == {
        name: one.choice for name, one in found.items() if one.choice != "linear"
    }
    assert all(
        (one.body, one.decision, one.value, one.limit) == (name, "strain", 0.3, 0.1) for name, one in found.items()
    )
    return {name: (one.choice, one.reason) for name, one in found.items()}


def test_strains_that_can_be_are_built_together(write_case: Any, craft: str):
    found = advised(
        write_case,
        craft,
        {"a": CONDENSED, "b": LUMPED, "c": CONDENSED, "d": CONDENSED, "e": CONDENSED},
        {"a": "condensed", "b": "nonlinear", "c": "linear", "d": "condensed"},
        bound="d",
    )
    assert found == {
        "a": ("condensed", "a bends"),
        "b": ("nonlinear", "b bends"),
        "c": ("linear", "c bends"),
        "d": ("linear", "with some key it is bound; d bends"),
    }


def test_a_body_that_cannot_be_as_advised_is_otherwise_and_the_others_as_advised(write_case: Any, craft: str):
    found = advised(
        write_case,
        craft,
        {"a": LUMPED, "b": CONDENSED, "c": NEITHER},
        {"a": "condensed", "b": "condensed", "c": "nonlinear"},
    )
    assert found["a"] == (
        "nonlinear",
        "a bends; condensed strain is not possible (the condensed form needs static derivatives as dependent shapes, "
        "which nodal displacements do not have. Give it strain = 'nonlinear', or a reduction to modes, such as "
        "'cantilever')",
    )
    assert found["b"] == ("condensed", "b bends")
    assert found["c"] == (
        "linear",
        "c bends; neither condensed nor nonlinear strain is possible (third derivatives of 9 shapes were requested; "
        "the set has 2)",
    )


@pytest.mark.parametrize("wanted", [{}, {"a": "linear"}])
def test_nothing_is_built_where_all_are_linear(write_case: Any, craft: str, wanted: dict[str, str]):
    assert advised(write_case, craft, {"a": CONDENSED}, wanted) == {name: ("linear", "a bends") for name in wanted}


ROD = """
[bodies.{0}]
kind = "analytic"
length = 2
mass = 1
EA = 1e7
EIy = 2000
EIz = 3000
GJ = 1500
radius = 0.02
functions = {{ y = 1, z = 1, axial = 1, family = "polynomial" }}
{1}
[[joints]]
kind = "weld"
parent = "hub"
child = "{0}"
"""


def test_a_body_keeps_the_strain_it_says_though_another_is_advised(monkeypatch):
    """Both rods bend as they spin up; the doubt about the one that says linear strain changes nothing of it."""
    empty = {"joint_shapes.richer_craft": None, "joint_shapes.joint_advice": {}, "decisions.buckling_margins": {}}
    empty |= {"decisions.truncation_doubts": [], "decisions.unassessed_truncation": []}
    for name, nothing in empty.items():  # of which nothing is asked here
        monkeypatch.setattr(f"femflex.pipeline.{name}", lambda *about, nothing=nothing: nothing)
    text = "[run]\nduration = 0.2\n[attitude]\nrates = [0, 0, 9]\n"
    text += "[bodies.hub]\nkind = 'rigid'\nmass = 50\ninertia = [90, 90, 90]\n"
    case = parse_case(text + ROD.format("open", "") + ROD.format("stated", "strain = 'linear'"))
    found = decided(case, thorough=True)
    wanted = {"open": "condensed", "stated": "linear"}
    strains = {one.body: (one.choice, one.doubt) for one in found.advice if one.decision == "strain"}
    assert strains == {"open": ("condensed", False), "stated": ("condensed", True)}
    assert {name: getattr(found.case.bodies[name], "strain", None) for name in wanted} == wanted
    assert {name: found.system.bodies[name].strain_form for name in wanted} == wanted


@pytest.mark.parametrize("group", ["TIP", "NOWHERE"])
def test_a_body_that_snaps_answers_its_loads_or_else_is_condensed(write_case: Any, craft: str, monkeypatch, group: str):
    """Static responses are written into the case of a body alone that can have them; the other boom stays as it is."""
    start, end = craft.index("[bodies.boom]"), craft.index("[[joints]]")
    boom, weld = craft[start:end].replace("modes = 4", "modes = 2"), craft[end : craft.index("[[loads]]")]
    text = craft[:start] + boom + weld + boom.replace("boom]", "plain]") + weld.replace('"boom"', '"plain"')
    case = read_case(write_case(text))
    keys = {"loads": {group: ["z"]}, "attachment": [], "derivatives": "none", "responses": 1, "deflection": 0.02}
    asked = []

    def answer(*about: Any) -> Advice:
        asked.append(about)
        return Advice("boom", "responses", keys, "1 of its shapes is a static response")

    monkeypatch.setattr("femflex.pipeline.chosen_strains.response_advice", answer)
    system: Any = object()
    origins = {name: Origin(None, open_choices(case.bodies[name]), "") for name in ("boom", "plain")}
    known = KnownBodies(origins)
    advice = {
        "boom": Advice("boom", "strain", "nonlinear", "it snaps", 0.3, 0.1),
        "plain": Advice("plain", "strain", "condensed", "it bends", 0.2, 0.1),
    }
    found, built, strains = bodies_that_stretch(case, system, known, advice, ["boom"])
    assert [(a.origin, *rest) for a, *rest in asked] == [(origins["boom"], system, "boom", {}, [])]
    can = group == "TIP"
    assert {name: one.part.strain_form for name, one in built.items()} == {
        "boom": "nonlinear" if can else "condensed",
        "plain": "condensed",
    }
    assert strains["plain"] == advice["plain"] and built["boom"].part.kinds.count("response") == can
    why = "it snaps; 1 of its shapes is a static response"
    if not can:
        why = "it snaps; static responses to its loads are not possible ("
    assert strains["boom"].reason.startswith(why) and (strains["boom"].reason == why) == can
    assert strains["boom"].choice == ("nonlinear" if can else "condensed") and strains["boom"].value == 0.3
    reduction: Any = found.bodies["boom"].reduction  # type: ignore[union-attr]
    assert (found is case) != can and ({key: getattr(reduction, key) for key in keys} == keys) == can
    assert found.bodies["plain"] is case.bodies["plain"]
