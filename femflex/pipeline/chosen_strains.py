"""Bodies in the strain that advice chose for them, or in the other where that one cannot be built."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from femflex.advice.advice import Advice
from femflex.advice.bodies import KnownBodies
from femflex.assembly.bodies import built_bodies
from femflex.assembly.open_choices import with_strains
from femflex.case.body import Strain
from femflex.case.case import Case
from femflex.case.problems import CaseError
from femflex.pipeline.joint_shapes import Built

OTHER: dict[Strain, Strain] = {"condensed": "nonlinear", "nonlinear": "condensed"}  # tried where one cannot be built


def bodies_with_strain(
    case: Case, origins: KnownBodies, chosen: Mapping[str, Advice]
) -> tuple[Built, dict[str, Advice]]:
    """The bodies that are to be other than linear, and the strain of each.

    A body that cannot be built in the chosen form gets the other one; it stays linear where neither can be built.
    """
    advised = dict(chosen)
    others = {name: advice for name, advice in advised.items() if advice.choice != "linear"}
    for name in [name for name in others if name in origins and origins[name].origin.bound]:
        reason = f"{origins[name].origin.bound}; {others.pop(name).reason}"
        advised[name] = replace(advised[name], choice="linear", reason=reason)
    try:
        return _as(case, {name: advice.choice for name, advice in others.items()}), advised
    except CaseError:
        built: Built = {}
        for name, advice in others.items():
            body, advised[name] = _alone(case, advice)
            built |= body
        return built, advised


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
