"""A Campbell diagram on the screen and as a CSV file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from femflex.cli.tables import print_table

if TYPE_CHECKING:
    from femflex.studies.campbell import Branch, Campbell

PRINTED = 1e-6  # damping ratio below which none is printed


def print_campbell(found: Campbell, scale: float, unit: str) -> None:
    """Print frequencies, damping where there is any, crossings, and what grows."""
    import numpy as np

    from femflex.dynamics.equilibria.small_motions import growth_rule

    if found.title:
        print(found.title)
    names, asked = [branch.name for branch in found.branches], np.flatnonzero(found.asked)

    def table(title: str, cell: str) -> None:
        rows = [
            [f"{found.speeds[k] / scale:.6g}", *(_cell(branch, k, cell) for branch in found.branches)] for k in asked
        ]
        print_table([f"{found.value} {unit}".strip(), *names], rows, title)

    frame = "" if found.value else " in the spinning frame"
    table(f"frequency{frame}, Hz (* unstable)", "frequencies")
    ratios = np.array([branch.damping_ratios[asked] for branch in found.branches])
    if np.nanmax(np.abs(ratios), initial=0.0) > PRINTED:
        table("damping ratio of oscillating modes (* unstable)", "damping_ratios")
    what = "values" if found.value else "speeds"
    if between := int((~found.asked).sum()):
        print(f"followed    through {between} additional {what}, where mode shapes change fast")
    for branch in found.branches:
        if branch.becomes:
            print(f"branch      {branch.name} ends as {branch.becomes}")
    if found.critical:
        print(
            f"critical    {', '.join(f'{speed / scale:.6g}' for speed in found.critical)} {unit}: the stiffness is "
            f"singular there, and no unique equilibrium exists; a row of the tables holds the limit from below"
        )
    if found.orders:
        print_crossings(found, scale, unit)
    for branch in found.branches:
        grows = np.flatnonzero(branch.growing)
        if len(grows):
            k, time = branch.fastest
            fastest = f"fastest at {found.speeds[k] / scale:.6g} {unit}, by a factor e in {time:.4g} s"
            print(f"unstable    {branch.name} grows from {found.speeds[grows[0]] / scale:.6g} {unit} on, {fastest}")
    if not any(branch.growing.any() for branch in found.branches):
        print(f"stability   stable: no motion grows at any of these {what}")
    print(f"growth      {growth_rule()}")
    if found.rigid:
        print(f"rigid       {', '.join(found.rigid)}: neither grow nor decay, and are no branches")


def print_crossings(found: Campbell, scale: float, unit: str) -> None:
    """Print at which speeds each branch meets each multiple of the spin."""
    met: dict[tuple[str, int], list[str]] = {}
    for one in found.crossings:
        met.setdefault((one.branch, one.order), []).append(f"{one.speed / scale:.6g}")
    rows = [
        [branch.name, *(", ".join(met.get((branch.name, order), ())) for order in found.orders)]
        for branch in found.branches
    ]
    if met:
        print_table([unit, *(f"{order}/rev" for order in found.orders)], rows, "speed at which it meets")
    else:
        print(f"crossing    none with {', '.join(f'{order}/rev' for order in found.orders)} at these speeds\n")


def _cell(branch: Branch, k: Any, what: str) -> str:
    value = float(getattr(branch, what)[k])
    grows = "*" if branch.growing[k] else ""
    return f"{value:.6g}{grows}" if value == value else ""


def write_table(found: Campbell, path: Path, force: bool) -> None:
    """Write every point of every branch as CSV, a line each."""
    import csv
    import math

    from femflex.writing import placed

    over = f"{found.value} [{found.unit}]" if found.unit else found.value
    heads = [
        over if found.value else "speed [rad/s]",
        "asked",
        "branch",
        "frequency [Hz]",
        "damping ratio",
        "growth [1/s]",
    ]
    with placed(path, force) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*heads, "stable", "character"])
        for branch in found.branches:
            for k, speed in enumerate(found.speeds):
                value = complex(branch.eigenvalues[k])
                if math.isnan(value.real):
                    continue
                damping = float(branch.damping_ratios[k])
                numbers = [float(branch.frequencies[k]), "" if math.isnan(damping) else damping, value.real]
                flags = [int(not branch.growing[k]), branch.characters[k]]
                writer.writerow([float(speed), int(found.asked[k]), branch.name, *numbers, *flags])
