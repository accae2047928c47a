"""Bodies that linear strain does not do for, with the strain that they want, or else with the other that can bend."""

from __future__ import annotations

from collections.abc import Mapping

from femflex.advice.choice import with_strains
from femflex.advice.strain import KEEPS
from femflex.assembly.bodies import build_bodies
from femflex.case.body import FlexibleTable, Strain
from femflex.case.case import Case
from femflex.case.problems import CaseError
from femflex.case.reduction import Stretchable
from femflex.system import Part

TRIED: tuple[Strain, ...] = ("condensed", "nonlinear")

Built = tuple[dict[str, Part], dict[str, tuple[Strain, str]]]  # bodies by name; strain and reason by name


Responding = Mapping[str, tuple[Case, str]]  # the case with responses in the reduction of a body, and to what


def stretching(
    case: Case, wanted: Mapping[str, tuple[Strain, str]], responding: Responding
) -> tuple[dict[str, Part], dict[str, tuple[Strain, str]], Case]:
    """The bodies that are to be condensed or nonlinear for these reasons, what is said of each, and the case then.

    Those that cannot be the one are the other; those that cannot be either are left out: linear, as they were.
    responding: of curved bodies that may snap, whose reasons leave open (%s) what they respond to.
    """
    parts: dict[str, Part] = {}
    snapping: dict[str, tuple[Strain, str]] = {}
    left = dict(wanted)
    for name, (answering, to) in responding.items():
        why = left[name][1]
        try:
            parts |= _built(answering, {name: "nonlinear"})
        except CaseError as error:
            first = error.problems[0].text.partition("\n")[0].rstrip(".")
            left[name] = "condensed", f"{why.partition(';')[0]}; it can take no responses to {to} ({first})"
            continue
        del left[name]
        snapping[name] = "nonlinear", why.replace("%s", to)
        case = case.model_copy(update={"bodies": {**case.bodies, name: answering.bodies[name]}})
    others, said = _straight(case, left)
    return parts | others, said | snapping, case


def _straight(case: Case, wanted: Mapping[str, tuple[Strain, str]]) -> Built:
    """The bodies without responses, and what is said of them."""
    said: dict[str, tuple[Strain, str]] = {}
    for name, (_, why) in wanted.items():
        if bound := bound_to_linear(case, name):
            said[name] = "linear", f"{bound}; {why.replace(KEEPS, '')}"
    others = {name: one for name, one in wanted.items() if name not in said}
    try:
        return _built(case, {name: strain for name, (strain, _) in others.items()}), said | others
    except CaseError:
        found: Built = {}, said
        for name, (strain, why) in others.items():
            parts, told = _alone(case, name, strain, why)
            found[0].update(parts)
            found[1].update(told)
        return found


def bound_to_linear(case: Case, name: str) -> str:
    """Why a body is to stay linear whatever bends it; nothing where it need not."""
    table = case.bodies[name]
    if not isinstance(table, FlexibleTable):
        return ""
    if not isinstance(table.reduction, Stretchable):
        method = getattr(table.reduction, "method", "none")
        return f"its reduction ({method!r}) knows no other form (one with derivatives, such as 'cantilever', does)"
    if table.reduction.derivatives in ("none", 0):
        return (
            f"derivatives = {table.reduction.derivatives!r} leaves its set without shapes that let bending go without "
            "stretching (without that key it would be condensed)"
        )
    return ""


def _alone(case: Case, name: str, wanted: Strain, why: str) -> Built:
    refused: list[str] = []
    for strain in sorted(TRIED, key=lambda one: one != wanted):
        try:
            parts = _built(case, {name: strain})
        except CaseError as error:
            refused.append(error.problems[0].text.partition("\n")[0].rstrip("."))
            continue
        told = f"; it cannot be {wanted} ({refused[0]})" if refused else ""
        return parts, {name: (strain, why + told)}
    return {}, {name: ("linear", f"{why}; it can be neither {' nor '.join(TRIED)} ({refused[0]})")}


def _built(case: Case, strains: Mapping[str, Strain]) -> dict[str, Part]:
    said = with_strains(case, strains)
    return build_bodies(said.model_copy(update={"bodies": {name: said.bodies[name] for name in strains}}))
