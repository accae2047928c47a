"""The strain forms that advice selects, replaced by others where a body cannot be built with them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace

from femflex.advice.advice import Advice
from femflex.advice.bodies import BodyOrigins
from femflex.assembly.bodies import built_body
from femflex.assembly.open_choices import with_strains
from femflex.case.body import Strain
from femflex.case.case import Case
from femflex.noun.problems import CaseError
from femflex.warning import PhysicsWarning

OTHER: dict[Strain, Strain] = {"condensed": "nonlinear", "nonlinear": "condensed"}  # tried where one cannot be built


def forms_that_exist(case: Case, origins: BodyOrigins, advised: Mapping[str, Advice]) -> dict[str, Advice]:
    """The advised strain of each body, or the other form where it cannot be built; linear if neither can be."""
    return {name: _form_that_exists(case, origins, advice) for name, advice in advised.items()}


def _form_that_exists(case: Case, origins: BodyOrigins, advice: Advice) -> Advice:
    if advice.choice == "linear":
        return advice
    if advice.body in origins and (bound := origins[advice.body].origin.bound):
        return replace(advice, choice="linear", reason=f"{bound}; {advice.reason}")
    forms: tuple[Strain, Strain] = advice.choice, OTHER[advice.choice]
    errors: list[str] = []
    for strain in forms:
        if not (error := _error_of(with_strains(case, {advice.body: strain}), advice.body)):
            text = f"; {advice.choice} strain is not possible ({errors[0]})" if errors else ""
            return replace(advice, choice=strain, reason=advice.reason + text)
        errors.append(error)
    text = f"; neither {' nor '.join(sorted(forms))} strain is possible ({errors[0]})"
    return replace(advice, choice="linear", reason=advice.reason + text)


def _error_of(case: Case, name: str) -> str:
    """The first line of the first problem of a body; empty where it can be built."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # issued where the body is built for the run
            built_body(case, name)
    except CaseError as error:
        return error.problems[0].text.partition("\n")[0].rstrip(".")
    return ""
