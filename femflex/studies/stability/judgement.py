"""Assessment of whether an equilibrium or a periodic motion is stable, and by which forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.case import CaseError
from femflex.dynamics.motion.freedoms import frame_rate, usual_sizes
from femflex.integrate import IntegrationError
from femflex.linear.equations import linearised
from femflex.linear.equilibrium import Equilibrium, EquilibriumError, rest_equilibrium
from femflex.linear.system_modes import modes_about
from femflex.studies.floquet import floquet, periodic_state
from femflex.system import System

NONE, UNSTABLE, GYROSCOPIC, STATIC = -1, 0, 1, 2
KINDS = {
    NONE: "none",
    UNSTABLE: "unstable",
    GYROSCOPIC: "stable by gyroscopic forces alone",
    STATIC: "stable",
}
ALIKE = 1e-6  # relative distance of a pole to the eigenvalue of a mode up to which it has the mode's name
DEFINITE = 1e-9  # of the orbit's rate squared times the largest inertia: a stiffness above minus this counts as zero


@dataclass(frozen=True, eq=False)
class Judgement:
    """Kind of KINDS, growth [1/s] of the fastest motion, poles [1/s] or multipliers (n,), and the reason for no result.

    about: the equilibrium, if one is assessed; lost: whether none was found; trivial, split: those of the `Floquet` of
    a motion.
    """

    kind: int
    growth: float
    values: ComplexArray
    problem: str = ""
    about: Equilibrium | None = None
    trivial: tuple[str, ...] = ()
    split: float = 0.0
    lost: bool = False

    @property
    def loads(self) -> int:
        """Number of loads that act in the equilibrium; 0 without one."""
        return 0 if self.about is None else len(self.about.moving.loads)

    @property
    def size(self) -> int:
        """Number of states of the craft, those of known motions too."""
        if self.about is None:
            return len(self.values)
        moving = self.about.moving
        return 2 * len(moving.velocity_names()) + len(moving.state_names())

    def names(self) -> tuple[str, ...]:
        """Names (n,) of the modes that the poles belong to, "" where they are not known."""
        if self.about is None or not len(self.values):
            return ("",) * len(self.values)
        modes = modes_about(self.about)
        elastic = np.flatnonzero(~modes.known)
        distance = np.abs(np.abs(modes.eigenvalues[elastic].real[:, None] - self.values.real)) + np.abs(
            np.abs(modes.eigenvalues[elastic].imag)[:, None] - np.abs(self.values.imag)
        )
        nearest = np.argmin(distance, axis=0) if len(elastic) else np.zeros(0, int)
        return tuple(
            modes.names[elastic[k]] if distance[k, j] <= ALIKE * abs(self.values[j]) else ""
            for j, k in enumerate(nearest)
        )

    @property
    def stable(self) -> bool:
        """Whether nothing grows."""
        return self.kind > UNSTABLE


def no_judgement(problem: str, lost: bool = False) -> Judgement:
    """The judgement without a result; lost: whether the reason is that there is no equilibrium."""
    return Judgement(NONE, float("nan"), np.zeros(0, complex), problem, lost=lost)


def equilibrium_stability(system: System) -> Judgement:
    """The stability of the equilibrium of a system by its poles.

    In orbit it is due to gyroscopic forces if the stiffness is not positive definite. Without an equilibrium the
    judgement has no result.
    """
    try:
        about, _ = rest_equilibrium(system)
    except (EquilibriumError, ValueError) as error:
        return no_judgement(str(error), isinstance(error, EquilibriumError))
    values = about.eigenvalues
    if not about.stable or about.model.system.frame.kind != "orbital":
        kind = STATIC if about.stable else UNSTABLE
        return Judgement(kind, float(values.real.max(initial=0.0)), values, about=about)
    linear = linearised(about.model, 0.0, about.x)
    sizes, rate = usual_sizes(about.model)[linear.free], frame_rate(about.model.system)
    M, K = linear.M * np.outer(sizes, sizes), linear.K * np.outer(sizes, sizes) / rate**2
    return judgement_of_matrices(values, True, M, K, about)


def judgement_of_matrices(
    values: ComplexArray, stable: bool, M: Array, K: Array, about: Equilibrium | None = None
) -> Judgement:
    """The judgement of poles in orbit: stable ones are due to gyroscopic forces unless K is positive definite.

    M, K (n, n): mass and stiffness over the square of the orbit's rate, scaled by the usual sizes of coordinates
    """
    kind = UNSTABLE
    if stable:
        least = np.linalg.eigvalsh((K + K.T) / 2)[0] if len(K) else 0.0
        kind = STATIC if least >= -DEFINITE * np.abs(M).max(initial=0.0) else GYROSCOPIC
    return Judgement(kind, float(values.real.max(initial=0.0)), values, about=about)


def motion_stability(system: System, period: float, shooting: bool = False) -> Judgement:
    """The stability of the motion of a period [s] by its Floquet multipliers, found by shooting if requested."""
    try:
        result = floquet(system, period, periodic_state(system, period) if shooting else None)
    except (ValueError, IntegrationError, CaseError) as error:
        return no_judgement(str(error))
    largest = float(np.abs(result.multipliers).max(initial=0.0))
    growth = float(np.log(max(largest, 1e-300)) / period)
    kind = STATIC if result.stable else UNSTABLE
    return Judgement(kind, growth, result.multipliers, trivial=result.trivial, split=result.split)
