"""Warnings about physics that the bodies of a case give rise to; each shows the number found and its measure."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping

import numpy as np

from femflex.advice.extents import warn_of_doubtful_extents
from femflex.advice.supports import warn_of_bodies_held_elsewhere, warn_of_supports_carried_along
from femflex.assembly.torques import unmoved_by_torque
from femflex.body import FlexibleBody
from femflex.case.body import FlexibleTable
from femflex.case.case import Case
from femflex.warning import PhysicsWarning

CARRIED = 0.75  # of the mass; one bending mode of a uniform cantilever carries 61 %, two 80 %


def warn_of_doubtful_bodies(case: Case, bodies: Mapping[str, FlexibleBody], output_step: float) -> None:
    """Warn of meshes in the wrong unit, mode sets that carry little of the mass or are held elsewhere than they
    are clamped, torques that bend nothing, and modes too fast for the output."""
    warn_of_bodies_held_elsewhere(case, bodies)
    warn_of_supports_carried_along(case, bodies)
    _warn_of_idle_torques(case, bodies)
    looked_at: set[int] = set()
    for name, body in bodies.items():
        if name not in case.bodies or id(body.moments) in looked_at:  # a segment, or shared by alike tables
            continue
        looked_at.add(id(body.moments))
        table = case.bodies[name]
        if isinstance(table, FlexibleTable):
            warn_of_doubtful_extents(case, name, table, body)
        if set(body.kinds) == {"vibration"}:
            carried = carried_mass(body)
            if carried < CARRIED:
                _warn(
                    f"bodies.{name}: its {body.n_modes} modes carry at most {carried:.0%} of its mass in any "
                    f"direction, "
                    f"less than {CARRIED:.0%}; more modes, or `attachment` shapes, follow an accelerated root better"
                )
        omega = body.omega[np.isfinite(body.omega) & (body.omega > 0)]
        if len(omega) and output_step > math.pi / omega[0]:
            _warn(
                f"run: an output step of {output_step:.4g} s shows up to {0.5 / output_step:.4g} Hz, and the first "
                f"mode of "
                f"body {name!r} has {omega[0] / (2 * math.pi):.4g} Hz; its vibration is computed but cannot be "
                f"seen in the output"
            )


def _warn_of_idle_torques(case: Case, bodies: Mapping[str, FlexibleBody]) -> None:
    for name, body in bodies.items():
        for load, marker in unmoved_by_torque(case, name, body.markers):
            _warn(
                f"loads[{load}]: none of the {body.n_modes} shapes of body {name!r} turns its marker {marker!r}, "
                "though they move it, so that the torque bends nothing; choose a marker on several nodes, or shapes "
                "that turn"
            )


def carried_mass(body: FlexibleBody) -> float:
    """Largest fraction of the mass that the elastic coordinates carry in any direction."""
    body = body.without_slaves()
    s, Me = body.moments.first[1:], body.moments.elastic_mass()
    return float(np.linalg.eigvalsh(s.T @ np.linalg.solve(Me, s))[-1] / body.moments.mass)


def _warn(text: str) -> None:
    warnings.warn(text, PhysicsWarning, stacklevel=4)
