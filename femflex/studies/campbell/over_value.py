"""Frequencies of a craft over any value of its case: branches named by their mode and tracked by their shapes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.case import Case
from femflex.dynamics.linear.character import motion_character
from femflex.dynamics.linear.equilibrium import EquilibriumError, rest_equilibrium
from femflex.studies.campbell.diagram import Campbell, assembled_diagram
from femflex.studies.campbell.matching import Match
from femflex.studies.campbell.sweep import Spin, tracked_motions
from femflex.studies.varied_case import VariedCase

MODES = 6  # default number of tracked branches


def value_diagram(
    case: Case,
    path: str,
    values: Sequence[float],
    unit: str = "",
    *,
    modes: int = MODES,
    progress: Callable[[float], None] | None = None,
) -> Campbell:
    """The diagram of frequencies of the equilibrium over rising values at a key path, such as "joints.0.stiffness".

    unit: of the values, as a case writes it; modes: every branch that is among this many lowest ones at some value
    is tracked. Raises CaseError for a path or a value that the case does not take, ValueError for values that do not
    rise or change the number of coordinates, EquilibriumError with the value at which there is no equilibrium.
    """
    matched_motions = list(value_motions(case, path, values, unit, modes, progress))
    return with_value_axis(assembled_diagram(matched_motions, modes, (), case.title), path, unit)


def with_value_axis(diagram: Campbell, path: str, unit: str) -> Campbell:
    """The diagram with this value on its axis, in place of the speed."""
    return replace(diagram, value=path, unit=unit)


def value_motions(
    case: Case,
    path: str,
    values: Sequence[float],
    unit: str = "",
    modes: int = MODES,
    progress: Callable[[float], None] | None = None,
) -> Iterator[tuple[Spin, Match | None]]:
    """The small motions at every value in turn, and their match with those before."""
    if len(values) < 2 or not (np.diff(values) > 0).all():
        raise ValueError(f"the values of {path} are to rise; found {list(values[:6])}")
    varied, counts, load_counts = VariedCase.from_paths(case, [path]), list[int](), list[int]()

    def motions(value: float, state: Array | None, requested: bool) -> Spin:
        system = varied.system({path: f"{float(value)!r} {unit}" if unit else float(value)})
        try:
            about = rest_equilibrium(system)[0]
        except EquilibriumError as error:
            raise EquilibriumError(f"at {path} = {value:.6g} {unit}".rstrip() + f" {error}", error.last) from None
        load_counts.append(len(about.moving.loads))
        if load_counts[-1] != load_counts[0]:
            sides = ("at", "below") if load_counts[-1] < load_counts[0] else ("below", "at")
            raise EquilibriumError(
                f"{sides[0]} {path} = {value:.6g} {unit}".rstrip() + " no equilibrium was found under the loads that "
                f"act {sides[1]} it; let the values stay on one side of it",
                about,
            )
        craft_motions, model = about.motions.of_craft(), about.model
        counts.append(model.n_u)
        if counts[-1] != counts[0]:
            raise ValueError(
                f"the craft has {counts[-1]} degrees of freedom at {path} = {value:g} and {counts[0]} before; branches "
                "need a value that changes none of them"
            )
        spinning = model.system.frame.kind == "spinning" and bool(np.any(model.system.frame.rate))
        words = motion_character(model, craft_motions, model.system.frame.rate if spinning else None).words
        return Spin(value, requested, about.x, craft_motions, words)

    yield from tracked_motions(motions, list(map(float, values)), modes, progress)
