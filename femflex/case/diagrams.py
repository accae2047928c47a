"""Checks of [campbell], and of the entries of [expect] about its diagram."""

from __future__ import annotations

from collections.abc import Iterator

from femflex.case.campbell import CampbellTable
from femflex.case.measure import OF_CAMPBELL
from femflex.case.orbit import AttitudeTable, OrbitTable
from femflex.case.outline import Outline
from femflex.noun.problems import Problem

NEAR = 1e-9  # relative difference of two speeds that are the same


def spin_problems(table: CampbellTable, attitude: AttitudeTable, orbit: OrbitTable) -> Iterator[Problem]:
    """Problems of a craft without a selectable spin speed or without a spin axis."""
    if orbit.kind != "none":
        yield Problem("campbell", "found an [orbit], on which no spin speed is steady; remove [orbit] or [campbell]")
    elif table.axis is None and not any(attitude.spin or ()):
        yield Problem(
            "campbell.axis",
            "found no axis to spin about; give axis = [0, 0, 1], or [attitude] frame = 'spinning' and a spin about it",
        )


def diagram_problems(outline: Outline) -> Iterator[Problem]:
    """Problems of a Campbell diagram without a spin, and of answers at speeds that it does not have."""
    table, attitude, orbit = outline.campbell, outline.attitude, outline.orbit
    if table is not None and attitude is not None and orbit is not None:
        yield from spin_problems(table, attitude, orbit)
    for name, answer in (outline.expect.answers if outline.expect else {}).items():
        if answer.of != OF_CAMPBELL or answer.speed is None:
            continue
        if table is None:
            yield Problem(f"expect.{name}.of", f"found {OF_CAMPBELL!r} in a case without a [campbell]; give one")
        elif min(abs(speed - answer.speed) for speed in table.speeds) > NEAR * table.speeds[-1]:
            text = ", ".join(f"{speed / table.speeds.scale:.6g}" for speed in table.speeds[:8])
            yield Problem(
                f"expect.{name}.speed",
                f"found {answer.speed / table.speeds.scale:.6g} {table.speeds.unit}, which is none of the diagram's "
                f"{len(table.speeds)} speeds ({text}{', ...' if len(table.speeds) > 8 else ''})",
            )
