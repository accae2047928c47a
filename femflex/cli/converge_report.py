"""What `femflex converge` says of its studies: tables, verdicts, JSON and a picture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from femflex.cli.advice_lines import print_notes
from femflex.cli.tables import print_json, print_table

if TYPE_CHECKING:
    from femflex.studies import Convergence, FunctionStudy, StrainStudy

    Finding = Convergence | StrainStudy | FunctionStudy

LEVEL = (
    "modes per body; coordinates are those of all bodies, with the static shapes that femflex adds for the loads and "
    "joints. Fewer modes may need more static shapes."
)


@dataclass(frozen=True)
class StudyOutputs:
    """What is to be made of a study."""

    tolerance: float | None
    as_json: bool
    picture: Path | None
    theme: str
    force: bool

    def check(self) -> None:
        """Raise before any work what would be found wrong after it."""
        if self.tolerance is not None and not 0.0 < self.tolerance < 1.0:
            raise ValueError(f"--tolerance is {self.tolerance:g}; give a relative error between 0 and 1, such as 1e-3")
        if self.picture is not None:
            from femflex.view.convergence import check_kind
            from femflex.view.theme import theme_of
            from femflex.writing import check_destination

            theme_of(self.theme)
            check_kind(self.picture)
            check_destination(self.picture, self.force)

    def begin(self, notes: Mapping[str, str]) -> None:
        """Print why bodies have the strain they have, where the case does not say it."""
        if not self.as_json:
            print_notes(notes)

    def say(self, found: Finding) -> None:
        """Print one study as it is done."""
        if not self.as_json:
            printers = {"strain": print_forms, "functions": print_kinds}
            printers.get(found.over, print_study)(found)  # type: ignore[operator]

    def report(self, findings: list[Finding], notes: Mapping[str, str], complete: bool) -> None:
        """Print what they come to together, with the notes on bodies as JSON too, and draw them on request."""
        from femflex.studies import choice, choice_text

        if self.as_json and len(findings) == 1:
            print_json(findings[0].to_dict() | {"notes": dict(notes)})
        elif self.as_json and findings:
            chosen = {found.over: choice(found) for found in findings}
            studies = [found.to_dict() for found in findings]
            print_json({"studies": studies, "choice": chosen, "verdict": choice_text(findings), "notes": dict(notes)})
        elif len(findings) > 1:
            print(fill(f"together    {choice_text(findings)}", 110, subsequent_indent=" " * 12))
        if self.picture is not None and complete:  # an interrupt does not wait for a picture
            from femflex.view.side_by_side import plot_studies

            plot_studies(findings, self.picture, choice_text(findings), self.theme, force=self.force)
            if not self.as_json:
                print(f"picture     {self.picture}")


def print_forms(found: StrainStudy) -> None:
    """Print the comparison of the three forms of strain."""
    from math import isfinite

    print(f"{found.title} [{found.unit}]" if found.unit not in ("", "1") else found.title)
    rows = []
    for form in found.forms:
        off = found.difference(form)
        counts = [str(n) for n in (form.coordinates, form.coordinates - form.derivatives, form.derivatives)]
        text = [f"{form.value:.12g}", f"{off:.2e}", f"{form.seconds:.3g}"] if isfinite(off) else ["", "", ""]
        rows.append(
            [form.strain, *counts, str(form.followers), *text, "<-" if form.strain == found.recommended else ""]
        )
    heads = ["strain", "coordinates", "vibration", "derivatives", "dependent", "value", "difference", "seconds", ""]
    print_table(heads, rows)
    print(fill(f"verdict     {found.verdict}", 110, subsequent_indent=" " * 12))


def print_kinds(found: FunctionStudy) -> None:
    """Print the comparison of types of functions."""
    print(f"{found.title} [{found.unit}]" if found.unit not in ("", "1") else found.title)
    rows = []
    for kind, study in found.with_values:
        off = found.differences(study) if found.reference is not None else study.values * 0.0
        for k, level in enumerate(study.levels):
            mark = "<-" if found.chosen == (kind, int(level)) else ""
            rows.append([kind, str(level), str(study.counts[k]), f"{study.values[k]:.12g}", f"{off[k]:.2e}", mark])
    print_table(["functions", "a field", "coordinates", "value", "difference", ""], rows)
    print(fill(f"verdict     {found.verdict}", 110, subsequent_indent=" " * 12))


def print_study(found: Convergence) -> None:
    """Print table, order, limit and verdict."""
    from math import isfinite

    print(f"{found.title} [{found.unit}]" if found.unit not in ("", "1") else found.title)
    rows, apart, heads = [], *derivatives_apart(found)
    for k, level in enumerate(found.levels):
        change, error = found.changes[k], found.errors[k]
        found_text = [f"{change:.3e}" if isfinite(change) else "", f"{error:.2e}" if isfinite(error) else ""]
        mark = "<-" if level == found.recommended else ""
        rows.append([str(level), str(found.counts[k]), *apart[k], f"{found.values[k]:.12g}", *found_text, mark])
    print_table([*heads, "value", "change", "error", ""], rows)
    if found.over == "modes" and found.added.any():
        print(fill(f"level       {LEVEL}", 110, subsequent_indent=" " * 12))
    for text in found.left_out:
        print(fill(f"left out    {text}", 110, subsequent_indent=" " * 12))
    print(fill(f"verdict     {found.verdict}", 110, subsequent_indent=" " * 12))


def derivatives_apart(found: Convergence) -> tuple[list[list[str]], list[str]]:
    """Further cells of every row that count vibration and derivative shapes apart, and the heads before the value."""
    if found.over == "mesh":
        return [[] for _ in found.levels], ["refined", "dofs"]
    of = "shapes" if found.over == "derivatives" and found.followers.any() else "coordinates"
    parts: list[Any] = []
    heads = [found.over, of]
    if found.over == "modes" and found.added.any():
        parts, heads = [*parts, found.added], [*heads, "static shapes"]
    if found.derivatives.any() or found.followers.any():
        inside = found.derivatives + (found.followers if of == "shapes" else 0)
        parts, heads = [*parts, found.counts - inside, found.derivatives], [*heads, "vibration", "derivatives"]
    if found.followers.any():
        parts, heads = [*parts, found.followers], [*heads, "dependent"]
    return [[str(part[k]) for part in parts] for k in range(len(found.levels))], heads
