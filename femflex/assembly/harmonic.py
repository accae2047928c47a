"""Meshed bodies in the shapes of their motion at one frequency, solved on the whole mesh."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from femflex.arrays import Array
from femflex.assembly.bodies import marker_groups, patch_groups, turning_markers, with_markers
from femflex.assembly.decks import load_sets_of, with_deck
from femflex.assembly.structures import build_modes, preload_of, structure_of
from femflex.body import FlexibleBody
from femflex.case.body import FlexibleTable
from femflex.case.case import Case
from femflex.fem.support import COMPONENTS
from femflex.reduction.methods import Cantilever, CraigBampton, FreeFree
from femflex.reduction.modes.damping import Damping
from femflex.reduction.modes.residuals import with_harmonic_responses
from femflex.reduction.modes.vibration import load_vectors
from femflex.reduction.reduce import small_motion_body
from femflex.warning import PhysicsWarning


def is_solved_whole(case: Case, name: str) -> bool:
    """Whether the body of that name has a mesh whose degrees of freedom can be solved at a frequency."""
    table = case.bodies[name]
    return (
        isinstance(table, FlexibleTable)
        and table.segmented_member is None
        and isinstance(with_deck(case, name, table).reduction, Cantilever | CraigBampton | FreeFree)
    )


def harmonic_body(case: Case, name: str, omega: float, loss_factor: float = 0.0) -> FlexibleBody:
    """A meshed body for harmonic motion at omega [rad/s], with its own damping at this frequency.

    A fraction zeta of critical damping is a loss factor 2 zeta at all frequencies. loss_factor: structural damping that
    the linear model adds. Forces may act at all markers of the body.
    """
    table = case.bodies[name]
    assert isinstance(table, FlexibleTable)
    table, groups = with_deck(case, name, table), marker_groups(table)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # said of the reduced body
        as_built = structure_of(case, name, table)
        structure, modes = build_modes(as_built, table, preload=preload_of(case, name, table))
        clamps = getattr(table.reduction, "clamp", {})
        loaded = {group: COMPONENTS for group in dict.fromkeys(groups.values()) if group not in clamps}
        F = load_vectors(structure, COMPONENTS if modes.held.size else (), loaded)
        mass, stiffness = _rates(table.damping, omega, modes.omega)
        factor = 1.0 + 1j * (omega * stiffness + loss_factor)
        shapes = with_harmonic_responses(structure, modes, F, omega, factor, 1.0 - 1j * mass / omega)
        turning, patches = turning_markers(case, name), patch_groups(case, name)
        body = small_motion_body(structure, shapes, groups, turning, patches, load_sets_of(case, name, table))
    damping = mass * body.moments.elastic_mass() + stiffness * body.strain.V1
    return with_markers(replace(body, damping=damping), name, table)


def _rates(damping: Damping | None, omega: float, modes: Array) -> tuple[float, float]:
    """Numbers alpha [1/s] and beta [s] of D = alpha M + beta K that dissipate at omega [rad/s] as a damping does."""
    if damping is None:
        return 0.0, 0.0
    if damping.ratio is None:
        return damping.mass or 0.0, damping.stiffness or 0.0
    ratios = np.atleast_1d(np.asarray(damping.ratio, float))
    known = modes[: len(ratios)]
    nearest = int(np.argmin(np.abs(known - omega))) if len(known) else 0
    return 0.0, 2.0 * float(ratios[nearest]) / omega
