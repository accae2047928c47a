"""Bodies in the strain that advice chose for them, or in the other where that one cannot be built."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from femflex.advice.advice import Advice
from femflex.advice.bodies import KnownBodies
from femflex.advice.curved import response_advice
from femflex.assembly.bodies import built_bodies
from femflex.assembly.open_choices import with_responses_to, with_strains
from femflex.case.body import FlexibleTable, Strain
from femflex.case.case import Case
from femflex.case.problems import CaseError
from femflex.case.reduction import CantileverTable
from femflex.pipeline.joint_shapes import Built
from femflex.system import System

OTHER: dict[Strain, Strain] = {"condensed": "nonlinear", "nonlinear": "condensed"}  # tried where one cannot be built


def bodies_that_stretch(
    case: Case, system: System, known: KnownBodies, chosen: Mapping[str, Advice], snapping: Iterable[str]
) -> tuple[Case, Built, dict[str, Advice]]:
    """The case with responses written in, the bodies that are to be other than linear, and the strain of each.

    Those that cannot be the one form are the other; those that cannot be either stay linear.
    """
    built: Built = {}
    advised = dict(chosen)
    for name in snapping:
        table = case.bodies[name]
        assert isinstance(table, FlexibleTable) and isinstance(table.reduction, CantileverTable)
        answer = response_advice(known[name], system, name, table.reduction.loads, table.reduction.attachment)
        answering = with_responses_to(case, name, answer.choice)
        try:
            built |= _as(answering, {name: "nonlinear"})
        except CaseError as error:
            why = f"{advised[name].reason}; static responses to its loads are not possible ({_first(error)})"
            advised[name] = replace(advised[name], choice="condensed", reason=why)
            continue
        case = answering
        advised[name] = replace(advised[name], reason=f"{advised[name].reason}; {answer.reason}")
    others = {name: one for name, one in advised.items() if one.choice != "linear" and name not in built}
    for name in [name for name in others if name in known and known[name].origin.bound]:
        reason = f"{known[name].origin.bound}; {others.pop(name).reason}"
        advised[name] = replace(advised[name], choice="linear", reason=reason)
    try:
        return case, built | _as(case, {name: one.choice for name, one in others.items()}), advised
    except CaseError:
        for name, one in others.items():
            found, advised[name] = _alone(case, one)
            built |= found
        return case, built, advised


def _alone(case: Case, wanted: Advice) -> tuple[Built, Advice]:
    """A body in the form that is wanted, or else in the other, and the note on it."""
    refused: list[str] = []
    tried: list[Strain] = [wanted.choice, OTHER[wanted.choice]]
    for strain in tried:
        try:
            built = _as(case, {wanted.body: strain})
        except CaseError as error:
            refused.append(_first(error))
            continue
        text = f"; {wanted.choice} strain is not possible ({refused[0]})" if refused else ""
        return built, replace(wanted, choice=strain, reason=wanted.reason + text)
    text = f"; neither {' nor '.join(sorted(tried))} strain is possible ({refused[0]})"
    return {}, replace(wanted, choice="linear", reason=wanted.reason + text)


def _as(case: Case, strains: Mapping[str, Strain]) -> Built:
    if not strains:
        return {}
    made = with_strains(case, strains)
    return built_bodies(made.model_copy(update={"bodies": {name: made.bodies[name] for name in strains}}))


def _first(error: CaseError) -> str:
    """The first line of what an error says."""
    return error.problems[0].text.partition("\n")[0].rstrip(".")
