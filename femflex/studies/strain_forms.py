"""Comparison of linear, condensed and nonlinear strain in one case: its quantity, and the cost of each."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from femflex.assembly import build_part
from femflex.case import Case, CaseError
from femflex.case.body import Strain
from femflex.integrate import IntegrationError
from femflex.pipeline.case_bodies import with_own_strain
from femflex.studies.levels import LevelBodies, LevelSet, varied_names, with_level
from femflex.studies.study import Progress, Study, quantity_text, reason_without_value, require_study
from femflex.warning import PhysicsWarning

FORMS: tuple[Strain, ...] = ("linear", "condensed", "nonlinear")  # each holds for larger deflections than the last


@dataclass(frozen=True)
class StrainForm:
    """A case with one form of strain in all bodies that can take it.

    coordinates: number of all bodies; derivatives: number of derivative shapes among them; followers: number of
    dependent shapes; value of the quantity; seconds of the run, without building bodies; problem: reason for no value
    (nan), else empty.
    """

    strain: Strain
    coordinates: int
    derivatives: int
    followers: int
    value: float = math.nan
    seconds: float = math.nan
    problem: str = ""
    unit: str = ""


@dataclass(frozen=True, eq=False)
class StrainStudy:
    """The three forms, compared with the most accurate one."""

    title: str
    tolerance: float
    forms: tuple[StrainForm, ...]
    own: dict[str, str]
    over: str = "strain"

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return next((form.unit for form in self.forms if not form.problem), "")

    @property
    def reference(self) -> StrainForm | None:
        """The most accurate form that has a value."""
        return next((form for form in reversed(self.forms) if not form.problem), None)

    def difference(self, form: StrainForm) -> float:
        """Relative difference of a form's value from that of the reference; nan without values."""
        best = self.reference
        if best is None or form.problem:
            return math.nan
        return abs(form.value - best.value) / (abs(best.value) or 1.0)

    @property
    def recommended(self) -> str | None:
        """The simplest form within the tolerance of the reference; None with fewer than two values."""
        completed = [form for form in self.forms if not form.problem]
        if len(completed) < 2:
            return None
        return next(form.strain for form in completed if self.difference(form) <= self.tolerance)

    @cached_property
    def verdict(self) -> str:
        """The conclusions, in sentences."""
        best = self.reference
        if best is None or self.recommended is None:
            reason = f"only strain = {best.strain!r} has a value" if best else "no form has a value"
            return f"Nothing can be compared: {reason}."
        sentences = []
        for form in self.forms[: self.forms.index(best)]:
            if form.problem:
                sentences.append(f"{form.strain.capitalize()} strain has no value: {form.problem}.")
                continue
            enough = "is enough" if self.difference(form) <= self.tolerance else "is not enough"
            sentences.append(
                f"{form.strain.capitalize()} strain {enough}: {self.difference(form):.2g} off {best.strain} strain "
                f"(tolerance {self.tolerance:g}), in {form.seconds / best.seconds:.2g} of its time."
            )
        return " ".join([*sentences, f"Choose strain = {self.recommended!r}."])


def strain_forms(case: Case, tolerance: float | None = None, progress: Progress | None = None) -> StrainStudy:
    """The StrainStudy of a case's [study] quantity; every body with a choice of strain takes all three forms in turn.

    Raises ValueError when the case has no [study] or no such body.
    """
    table = require_study(case)
    case = with_own_strain(case)
    names = varied_names(case, "strain")
    forms = []
    for k, strain in enumerate(FORMS):
        if progress is not None:
            progress(k / len(FORMS))
        forms.append(_form(with_level(case, names, "strain", strain), names, strain))
    own = {name: case.bodies[name].strain or "not set" for name in names}  # type: ignore[union-attr]
    return StrainStudy(quantity_text(table.quantity), tolerance or table.tolerance, tuple(forms), own)


def _form(case: Case, names: Sequence[str], strain: Strain) -> StrainForm:
    """Result of a case with one form of strain; if it cannot be built or diverges, the result has the reason."""
    try:
        level_bodies = LevelBodies({name: build_part(case, name) for name in names}, 0)
    except CaseError as error:
        return StrainForm(strain, 0, 0, 0, problem=reason_without_value(case, error))
    coordinates = sum(body.n_modes for body in level_bodies.parts)
    counts = coordinates, level_bodies.derivatives, level_bodies.followers
    study = Study(case, "modes", LevelSet(tuple(names), (), None))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # large deflections with linear strain are intended here
        _ = study.constant
        start = time.perf_counter()
        try:
            value, unit, _ = study.value(level_bodies, lambda part: None)
        except (IntegrationError, ValueError) as error:
            return StrainForm(strain, *counts, problem=reason_without_value(case, error))
        return StrainForm(strain, *counts, value, time.perf_counter() - start, "", unit)
