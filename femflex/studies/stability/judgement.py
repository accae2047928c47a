"""Assessment of whether an equilibrium or a periodic motion is stable, and by which forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array, ComplexArray
from femflex.case import CaseError
from femflex.dynamics.linear.equations import linearised
from femflex.dynamics.linear.equilibrium import Equilibrium, EquilibriumError, rest_equilibrium
from femflex.dynamics.linear.freedoms import frame_rate, usual_sizes
from femflex.dynamics.linear.system_modes import modes_about
from femflex.integrate import IntegrationError
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
DEFINITE = (
    1e-9  # of the square of the orbit's rate times the largest inertia: a stiffness above minus this counts as zero
)


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
    growth = float(values.real.max(initial=0.0))
    if not about.stable:
        return Judgement(UNSTABLE, growth, values, about=about)
    if about.model.system.frame.kind != "orbital":
        return Judgement(STATIC, growth, values, about=about)
    linear = linearised(about.model, 0.0, about.x)
    sizes = usual_sizes(about.model)[linear.free]
    rate = frame_rate(about.model.system)
    return Judgement(
        STATIC if is_positive_definite(linear.M, linear.K, sizes, rate) else GYROSCOPIC, growth, values, about=about
    )


def is_positive_definite(M: Array, K: Array, sizes: Array, rate: float) -> bool:
    """Whether the stiffness K (n, n) is positive definite, but for rounding, in an orbit of a rate [rad/s].

    sizes (n,): usual sizes of the coordinates.
    """
    if not len(K):
        return True
    energy = (K + K.T) / 2 * np.outer(sizes, sizes)
    scale = rate**2 * np.abs(M * np.outer(sizes, sizes)).max()
    return bool(np.linalg.eigvalsh(energy)[0] >= -DEFINITE * scale)


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
