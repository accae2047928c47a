"""The compiled second-order calls of a model: whole, or with terms left out.

Each is compiled at the first call.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from femflex.dynamics.constraints.correction import correct as tied_correct
from femflex.dynamics.constraints.residual import residual, solve
from femflex.dynamics.motion.correction import correct
from femflex.dynamics.motion.second_order import advance, kinematic
from femflex.dynamics.terms.reduced import reduced_correct, reduced_residual


@dataclass(frozen=True)
class SecondOrderCalls:
    """The second-order calls over a model's own arrays.

    reduced      whether terms of the ledger are left out (see femflex.dynamics.terms.reduced)
    free         bodies whose length is free
    constrained  whether the system has loops or other constraints; the residual is then that of its tree
    """

    n_q: int
    n_u: int
    n_z: int = 0
    reduced: bool = False
    free: tuple[str, ...] = ()
    constrained: bool = False
    kinematic: Any = field(default=kinematic)
    advance: Any = field(default=advance)
    solve: Any = field(default=solve)

    @property
    def residual(self) -> Any:
        """The call of signature RESIDUAL."""
        return reduced_residual if self.reduced else residual

    @property
    def correct(self) -> Any:
        """The call of signature CORRECT; ValueError with free lengths where terms are left out, or constraints act."""
        if self.free and (self.reduced or self.constrained):
            reason = (
                "the system has loops or constraints, which implicit integrators cannot do together"
                if self.constrained
                else "terms of its equations are left out (`without`), which implicit integrators cannot do"
            )
            raise ValueError(f"body {self.free[0]!r} has a free length, and {reason}; set integrator = 'dop853'")
        if self.reduced:
            return reduced_correct
        return tied_correct if self.free or self.constrained else correct
