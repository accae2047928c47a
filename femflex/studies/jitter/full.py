"""Responses at given frequencies on all degrees of freedom of the meshes, beside those of the reduced model."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.assembly.bodies import build_part
from femflex.assembly.harmonic import harmonic_body, is_solved_whole
from femflex.assembly.shared import shared_structures
from femflex.case.body import RigidTable
from femflex.pipeline.start import system_of
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
