"""Bodies built again with the choices that advice makes, or in another strain where the selected one is impossible."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace

from femflex.advice.advice import Advice
from femflex.advice.bodies import BodyOrigins
from femflex.assembly.bodies import built_bodies
from femflex.assembly.open_choices import with_strains
from femflex.case.body import Strain
from femflex.case.case import Case
from femflex.noun.problems import CaseError
from femflex.pipeline.joint_shapes import Built
from femflex.warning import PhysicsWarning

OTHER: dict[Strain, Strain] = {"condensed": "nonlinear", "nonlinear": "condensed"}  # tried where one cannot be built


def bodies_with_strain(
    case: Case, origins: BodyOrigins, chosen: Mapping[str, Advice]
) -> tuple[Built, dict[str, Advice]]:
    """The bodies for which advice selects other than linear strain, and the strain of each body.

    A body that cannot be built in the selected form gets the other one; it stays linear where neither can be built.
    """
    advised = dict(chosen)
    others = {name: advice for name, advice in advised.items() if advice.choice != "linear"}
    for name in [name for name in others if name in origins and origins[name].origin.bound]:
        reason = f"{origins[name].origin.bound}; {others.pop(name).reason}"
        advised[name] = replace(advised[name], choice="linear", reason=reason)
    try:
        forms = {name: advice.choice for name, advice in others.items()}
        return rebuilt_bodies(with_strains(case, forms), others), advised
    except CaseError:
        built: Built = {}
        for name, advice in others.items():
            body, advised[name] = _build_or_fall_back(case, advice)
            built |= body
        return built, advised


def _build_or_fall_back(case: Case, advice: Advice) -> tuple[Built, Advice]:
    """The body in the advised strain form, or else in the other one, and the advice on it."""
    errors: list[str] = []
    forms: list[Strain] = [advice.choice, OTHER[advice.choice]]
    for strain in forms:
        try:
            built = rebuilt_bodies(with_strains(case, {advice.body: strain}), [advice.body])
        except CaseError as error:
            errors.append(_first_problem(error))
            continue
        text = f"; {advice.choice} strain is not possible ({errors[0]})" if errors else ""
        return built, replace(advice, choice=strain, reason=advice.reason + text)
    text = f"; neither {' nor '.join(sorted(forms))} strain is possible ({errors[0]})"
    return {}, replace(advice, choice="linear", reason=advice.reason + text)


def rebuilt_bodies(case: Case, names: Iterable[str], silent: bool = False) -> Built:
    """These bodies of a case, built by its present tables; silent: without repeating warnings."""
    part = case.model_copy(update={"bodies": {name: case.bodies[name] for name in names}})
    if not part.bodies:
        return {}
    with warnings.catch_warnings():
        if silent:
            warnings.simplefilter("ignore", PhysicsWarning)
        return built_bodies(part)


def _first_problem(error: CaseError) -> str:
    """The first line of the first problem of an error."""
    return error.problems[0].text.partition("\n")[0].rstrip(".")
