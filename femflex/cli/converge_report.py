"""Tables, verdicts, JSON and a picture of the studies of `femflex converge`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from femflex.cli.outputs import PAGE_SUFFIXES
from femflex.cli.tables import print_folded, print_json, print_table

if TYPE_CHECKING:
    from femflex.studies import Convergence, FunctionStudy, StrainStudy

    Finding = Convergence | StrainStudy | FunctionStudy

LEVEL = (
    "modes per body; coordinates are those of all bodies, with the static shapes that femflex adds for the loads and "
    "joints. Fewer modes may need more static shapes."
)


@dataclass(frozen=True)
class StudyOutputs:
    """Files and form in which studies are reported."""

    tolerance: float | None
    as_json: bool
    picture: Path | None
    theme: str
    force: bool

    def check(self) -> None:
        """Raise an error before the work starts if an option is wrong or a file could not be written."""
        if self.tolerance is not None and not 0.0 < self.tolerance < 1.0:
            raise ValueError(f"--tolerance is {self.tolerance:g}; give a relative error between 0 and 1, such as 1e-3")
        if self.picture is not None:
            from femflex.view.convergence import check_kind
            from femflex.view.theme import theme_of
            from femflex.writing import check_destination

            theme_of(self.theme)
            if self.picture.suffix.lower() not in PAGE_SUFFIXES:
                check_kind(self.picture)
            check_destination(self.picture, self.force)

    def print_finding(self, study: Finding) -> None:
        """Print the result of one study as soon as it is done."""
        if not self.as_json:
            printers = {"strain": print_forms, "functions": print_kinds}
            printers.get(study.over, print_study)(study)  # type: ignore[operator]

    def report(self, findings: list[Finding], notes: Mapping[str, str], complete: bool) -> None:
        """Print the common result of several studies, and JSON with the notes on bodies, and draw them on request."""
        from femflex.studies import recommendation_text, recommended_level

        if self.as_json and len(findings) == 1:
            print_json(findings[0].to_dict() | {"notes": dict(notes)})
        elif self.as_json and findings:
            choices = {finding.over: recommended_level(finding) for finding in findings}
            studies = [finding.to_dict() for finding in findings]
            print_json(
                {"studies": studies, "choice": choices, "verdict": recommendation_text(findings), "notes": dict(notes)}
            )
        elif len(findings) > 1:
            print_folded(f"together    {recommendation_text(findings)}")
        if self.picture is None or not complete:  # an interrupt does not wait for a picture
            return
        if self.picture.suffix.lower() in PAGE_SUFFIXES:
            from femflex.report.studies import write_convergence_report

            write_convergence_report(findings, recommendation_text(findings), self.picture, self.force)
            if not self.as_json:
                print(f"report      {self.picture}")
        else:
            from femflex.view.side_by_side import plot_studies

            plot_studies(findings, self.picture, recommendation_text(findings), self.theme, force=self.force)
            if not self.as_json:
                print(f"picture     {self.picture}")


def print_forms(study: StrainStudy) -> None:
    """Print the comparison of the three forms of strain."""
    from math import isfinite

    print(f"{study.title} [{study.unit}]" if study.unit not in ("", "1") else study.title)
    rows = []
    for form in study.forms:
        difference = study.difference(form)
        counts = [str(n) for n in (form.coordinates, form.coordinates - form.derivatives, form.derivatives)]
        text = (
            [f"{form.value:.12g}", f"{difference:.2e}", f"{form.seconds:.3g}"] if isfinite(difference) else ["", "", ""]
        )
        rows.append(
            [form.strain, *counts, str(form.followers), *text, "<-" if form.strain == study.recommended else ""]
        )
    heads = ["strain", "coordinates", "vibration", "derivatives", "dependent", "value", "difference", "seconds", ""]
    print_table(heads, rows)
    print_folded(f"verdict     {study.verdict}")


def print_kinds(comparison: FunctionStudy) -> None:
    """Print the comparison of types of functions."""
    print(f"{comparison.title} [{comparison.unit}]" if comparison.unit not in ("", "1") else comparison.title)
    rows = []
    for kind, study in comparison.with_values:
        differences = comparison.differences(study) if comparison.reference is not None else study.values * 0.0
        for k, level in enumerate(study.levels):
            mark = "<-" if comparison.choice == (kind, int(level)) else ""
            rows.append(
                [kind, str(level), str(study.counts[k]), f"{study.values[k]:.12g}", f"{differences[k]:.2e}", mark]
            )
    print_table(["functions", "a field", "coordinates", "value", "difference", ""], rows)
    print_folded(f"verdict     {comparison.verdict}")


def print_study(study: Convergence) -> None:
    """Print table, order, limit and verdict."""
    from math import isfinite

    print(f"{study.title} [{study.unit}]" if study.unit not in ("", "1") else study.title)
    rows, shape_counts, heads = [], *shape_count_columns(study)
    for k, level in enumerate(study.levels):
        change, error = study.changes[k], study.errors[k]
        error_texts = [f"{change:.3e}" if isfinite(change) else "", f"{error:.2e}" if isfinite(error) else ""]
        mark = "<-" if level == study.recommended else ""
        rows.append([str(level), str(study.counts[k]), *shape_counts[k], f"{study.values[k]:.12g}", *error_texts, mark])
    print_table([*heads, "value", "change", "error", ""], rows)
    if study.over == "modes" and study.added.any():
        print_folded(f"level       {LEVEL}")
    for text in study.left_out:
        print_folded(f"left out    {text}")
    print_folded(f"verdict     {study.verdict}")


def shape_count_columns(study: Convergence) -> tuple[list[list[str]], list[str]]:
    """Return further cells of every row that count vibration and derivative shapes, and the heads before the value."""
    if study.over == "mesh":
        return [[] for _ in study.levels], ["refined", "dofs"]
    count_head = "shapes" if study.over == "derivatives" and study.followers.any() else "coordinates"
    columns: list[Any] = []
    heads = [study.over, count_head]
    if study.over == "modes" and study.added.any():
        columns, heads = [*columns, study.added], [*heads, "static shapes"]
    if study.derivatives.any() or study.followers.any():
        inside = study.derivatives + (study.followers if count_head == "shapes" else 0)
        columns, heads = [*columns, study.counts - inside, study.derivatives], [*heads, "vibration", "derivatives"]
    if study.followers.any():
        columns, heads = [*columns, study.followers], [*heads, "dependent"]
    return [[str(column[k]) for column in columns] for k in range(len(study.levels))], heads
