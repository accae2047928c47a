"""A Campbell diagram on the screen and as a CSV file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from femflex.cli.tables import print_folded, print_table

if TYPE_CHECKING:
    from femflex.studies.campbell import Branch, Campbell

PRINTED = 1e-6  # damping ratio below which none is printed


def print_campbell(diagram: Campbell, scale: float, unit: str) -> None:
    """Print frequencies, damping if there is any, crossings, and the motions that grow."""
    import numpy as np

    from femflex.dynamics.linear.small_motions import growth_rule

    if diagram.title:
        print(diagram.title)
    names, requested = [branch.name for branch in diagram.branches], np.flatnonzero(diagram.requested)

    def table(title: str, cell: str) -> None:
        rows = [
            [f"{diagram.speeds[k] / scale:.6g}", *(_cell(branch, k, cell) for branch in diagram.branches)]
            for k in requested
        ]
        print_table([f"{diagram.value} {unit}".strip(), *names], rows, title)

    frame = "" if diagram.value else " in the spinning frame"
    table(f"frequency{frame}, Hz (* unstable)", "frequencies")
    ratios = np.array([branch.damping_ratios[requested] for branch in diagram.branches])
    if np.nanmax(np.abs(ratios), initial=0.0) > PRINTED:
        table("damping ratio of oscillating modes (* unstable)", "damping_ratios")
    noun = "values" if diagram.value else "speeds"
    if between := int((~diagram.requested).sum()):
        print(f"followed    through {between} additional {noun}, where mode shapes change fast")
    for branch in diagram.branches:
        if branch.final_character:
            print_folded(f"branch      {branch.name} ends as {branch.final_character}")
    if diagram.critical:
        print(
            f"critical    {', '.join(f'{speed / scale:.6g}' for speed in diagram.critical)} {unit}: the stiffness is "
            f"singular there, and no unique equilibrium exists; a row of the tables holds the limit from below"
        )
    if diagram.orders:
        print_crossings(diagram, scale, unit)
    for branch in diagram.branches:
        grows = np.flatnonzero(branch.growing)
        if len(grows):
            k, time = branch.fastest
            fastest = f"fastest at {diagram.speeds[k] / scale:.6g} {unit}, by a factor e in {time:.4g} s"
            start = f"{diagram.speeds[grows[0]] / scale:.6g} {unit}"
            print_folded(f"unstable    {branch.name} grows from {start} on, {fastest}")
    if not any(branch.growing.any() for branch in diagram.branches):
        print_folded(f"stability   stable: no motion grows at any of these {noun}")
    print_folded(f"growth      {growth_rule()}")
    if diagram.rigid:
        print_folded(f"rigid       {', '.join(diagram.rigid)}: neither grow nor decay, and are no branches")


def print_crossings(diagram: Campbell, scale: float, unit: str) -> None:
    """Print at which speeds each branch meets each multiple of the spin."""
    met: dict[tuple[str, int], list[str]] = {}
    for crossing in diagram.crossings:
        met.setdefault((crossing.branch, crossing.order), []).append(f"{crossing.speed / scale:.6g}")
    rows = [
        [branch.name, *(", ".join(met.get((branch.name, order), ())) for order in diagram.orders)]
        for branch in diagram.branches
    ]
    if met:
        print_table([unit, *(f"{order}/rev" for order in diagram.orders)], rows, "speed at which it meets")
    else:
        print(f"crossing    none with {', '.join(f'{order}/rev' for order in diagram.orders)} at these speeds\n")


def _cell(branch: Branch, k: Any, attribute: str) -> str:
    value = float(getattr(branch, attribute)[k])
    grows = "*" if branch.growing[k] else ""
    return f"{value:.6g}{grows}" if value == value else ""


def write_table(diagram: Campbell, path: Path, force: bool) -> None:
    """Write every point of every branch as CSV, a line each."""
    import csv
    import math

    from femflex.writing import atomic_file

    abscissa_head = f"{diagram.value} [{diagram.unit}]" if diagram.unit else diagram.value
    heads = [
        abscissa_head if diagram.value else "speed [rad/s]",
        "asked",
        "branch",
        "frequency [Hz]",
        "damping ratio",
        "growth [1/s]",
    ]
    with atomic_file(path, force) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*heads, "stable", "character"])
        for branch in diagram.branches:
            for k, speed in enumerate(diagram.speeds):
                value = complex(branch.eigenvalues[k])
                if math.isnan(value.real):
                    continue
                damping = float(branch.damping_ratios[k])
                numbers = [float(branch.frequencies[k]), "" if math.isnan(damping) else damping, value.real]
                flags = [int(not branch.growing[k]), branch.characters[k]]
                writer.writerow([float(speed), int(diagram.requested[k]), branch.name, *numbers, *flags])
