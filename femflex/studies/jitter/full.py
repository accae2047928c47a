"""Responses at given frequencies on all degrees of freedom of the meshes, beside those of the reduced model."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.assembly.bodies import build_part, marker_groups, patch_groups, turning_markers, with_markers
from femflex.assembly.decks import load_sets_of, with_deck
from femflex.assembly.shared import shared_structures
from femflex.assembly.structures import build_modes, preload_of, structure_of
from femflex.body import FlexibleBody
from femflex.case.body import FlexibleTable, RigidTable
from femflex.case.case import Case
from femflex.fem.support import COMPONENTS
from femflex.pipeline.start import system_of
from femflex.reduction.methods import Cantilever, CraigBampton, FreeFree
from femflex.reduction.modes.damping import Damping
from femflex.reduction.modes.residuals import with_harmonic_responses
from femflex.reduction.modes.vibration import load_vectors
from femflex.reduction.reduce import small_motion_body
from femflex.studies.jitter.plant import Plant, plant_of
from femflex.warning import PhysicsWarning

SHOWN = 1e-9  # of the largest response of an output, below which it is at rest
LEFT_OUT = 0.05  # of a response, from which on a reduced model is warned of


@dataclass(frozen=True, eq=False)
class FullResponse:
    """Responses of the outputs of a budget to its sources at frequencies (n,) [Hz].

    full, reduced  name of the source -> (n, n_out, n_c), on the meshes and on the shapes of the case
    kept           flexible bodies that are as in the case in both, such as those without a mesh
    """

    plant: Plant
    frequencies: Array
    full: Mapping[str, ComplexArray]
    reduced: Mapping[str, ComplexArray]
    kept: tuple[str, ...]

    def sizes(self, source: str) -> tuple[Array, Array]:
        """Root sum squares (n, n_out) [SI] over the components of a source: of the full and of the reduced response."""
        full, reduced = (np.linalg.norm(entry[source], axis=2) for entry in (self.full, self.reduced))
        return np.asarray(full), np.asarray(reduced)

    def left_out(self, source: str) -> Array:
        """Part (n, n_out) [1] of the full response to a source that the reduced model lacks; negative for too much."""
        full, reduced = self.sizes(source)
        moves = full > SHOWN * full.max(axis=0, initial=0.0)
        return np.asarray(np.where(moves, 1.0 - reduced / np.where(moves, full, 1.0), 0.0))


def full_response(reduced: Plant, frequencies: Array, progress: Callable[[str], None] | None = None) -> FullResponse:
    """The responses of the case of a plant at frequencies (n,) [Hz], on the meshes of its bodies.

    Each meshed body is solved at each frequency with its loss factor, twice its ratio
    of critical damping. Wheels are at their lowest speeds. Warns where the reduced model lacks more than 5 %.

    Raises ValueError for frequencies that are not above zero, and for a case without a mesh to be solved.
    """
    case, frequencies = reduced.case, np.asarray(frequencies, float)
    if not len(frequencies) or not (frequencies > 0).all():
        raise ValueError(f"found the frequencies {frequencies.tolist()} Hz; give some above 0")
    whole = [name for name in case.bodies if is_solved_whole(case, name)]
    if not whole:
        raise ValueError(
            "no body of the case has a mesh and modes, so there is no larger model than the reduced one; give a body "
            'of kind "flexible"'
        )
    kept = tuple(name for name, table in case.bodies.items() if name not in whole and not isinstance(table, RigidTable))
    say = progress or (lambda text: None)
    full: dict[str, list[ComplexArray]] = {name: [] for name in reduced.sources}
    with shared_structures(), warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # issued with the reduced model
        others = {name: build_part(case, name) for name in case.bodies if name not in whole}
        for frequency in frequencies:
            say(f"meshes at {frequency:.4g} Hz")
            omega = 2.0 * np.pi * float(frequency)
            solved = {name: harmonic_body(case, name, omega, reduced.table.loss_factor) for name in whole}
            plant = plant_of(system_of(case, {**others, **solved}), case)
            for name in reduced.sources:
                full[name].append(plant.response(np.array([frequency]), name)[0])
    answer = FullResponse(
        reduced,
        frequencies,
        {name: np.array(rows) for name, rows in full.items()},
        {name: reduced.response(frequencies, name) for name in reduced.sources},
        kept,
    )
    _warn(answer)
    return answer


def _warn(answer: FullResponse) -> None:
    worst = {source: np.abs(answer.left_out(source)) for source in answer.full}
    source = max(worst, key=lambda name: float(worst[name].max(initial=0.0)))
    i, k = np.unravel_index(int(np.argmax(worst[source])), worst[source].shape)
    if worst[source][i, k] > LEFT_OUT:
        warnings.warn(
            PhysicsWarning(
                f"the response of {answer.plant.names[k]} to {source} at {answer.frequencies[i]:.4g} Hz is "
                f"{worst[source][i, k]:.1%} off in the reduced model; give its bodies more modes, or static shapes at "
                "the markers of the sources"
            ),
            stacklevel=3,
        )


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
