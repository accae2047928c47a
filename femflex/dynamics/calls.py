"""The compiled second-order calls of a model: whole or with terms left out, with constraints or without.

Each is compiled at the first call.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from femflex.dynamics.constraints.correction import correct as constrained_correct
from femflex.dynamics.constraints.residual import residual as constrained_residual
from femflex.dynamics.motion.correction import correct
from femflex.dynamics.motion.free_correction import correct as free_correct
from femflex.dynamics.motion.residual import residual, solve
from femflex.dynamics.motion.second_order import advance, kinematic
from femflex.dynamics.terms.reduced import reduced_residual
from femflex.dynamics.terms.reduced_correction import reduced_correct


@dataclass(frozen=True)
class SecondOrderCalls:
    """The second-order calls over a model's own arrays.

    reduced  whether terms of the ledger are left out (see femflex.dynamics.terms.reduced)
    free     bodies whose length is free
    """

    n_q: int
    n_u: int
    n_z: int = 0
    reduced: bool = False
    free: tuple[str, ...] = ()
    kinematic: Any = field(default=kinematic)
    advance: Any = field(default=advance)

    @property
    def residual(self) -> Any:
        """The call of signature RESIDUAL."""
        if self.reduced:
            return reduced_residual
        return residual

    @property
    def correct(self) -> Any:
        """The call of signature CORRECT; ValueError with free lengths where terms are left out."""
        if self.free:
            if self.reduced:
                raise ValueError(
                    f"body {self.free[0]!r} has a free length, and terms of its equations are left out (`without`), "
                    "which implicit integrators cannot do; set integrator = 'dop853'"
                )
            return free_correct
        if self.reduced:
            return reduced_correct
        return correct

    @property
    def solve(self) -> Any:
        """The call of signature SOLVE."""
        return solve


class ConstrainedCalls(SecondOrderCalls):
    """The second-order calls of a model with loops or other constraints.

    The residual is M udot + h - Q - A^T lambda with the multipliers of the motion itself, of the whole equations alone;
    there is no `solve`.
    """

    @property
    def residual(self) -> Any:
        """The call of signature RESIDUAL; AttributeError where terms are left out."""
        if self.reduced:
            raise AttributeError("joint forces need all terms of the equations, and some are switched off (`without`)")
        return constrained_residual

    @property
    def correct(self) -> Any:
        """The call of signature CORRECT; ValueError with free lengths."""
        if self.free:
            raise ValueError(
                f"body {self.free[0]!r} has a free length, and the system has loops or constraints, which implicit "
                "integrators cannot do together; set integrator = 'dop853'"
            )
        if self.reduced:
            return super().correct
        return constrained_correct

    @property
    def solve(self) -> Any:
        """Raises AttributeError."""
        raise AttributeError("a constrained system has no mass matrix of its own; solve with that of its tree")
