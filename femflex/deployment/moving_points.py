"""Points of mass of a deploying member, as its shapes say."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.deployment.material import Places
from femflex.deployment.shapes import MemberShapes
from femflex.system import MovingPoints


def moving_points(shapes: MemberShapes, total: float, at_tip: bool) -> MovingPoints:
    """The points of quadrature of the deployed part, and the stowed part at the drum; total: mass of the whole [kg]."""
    deployed = shapes.places(*shapes.quadrature)
    drum = shapes.places(np.array([1.0 if at_tip else 0.0]), np.ones(1))
    density = shapes.member_mass / shapes.reference
    # material of the deployed part keeps its distance from the end that came out first; the drum keeps its xi
    first = _points(shapes, deployed, -deployed.xi if at_tip else 1.0 - deployed.xi)
    last = _points(shapes, drum, np.zeros(len(drum.xi)))
    k, m = len(deployed.xi), len(drum.xi)
    joined = {key: np.concatenate([first[key], last[key]]) for key in first}
    return MovingPoints(
        direction=shapes.axes.frame[0],
        mass=np.concatenate([np.zeros(k), total * drum.share]),
        density=density * np.concatenate([deployed.share, -drum.share]),
        drawn=np.concatenate([np.full(k, 0.0 if at_tip else 1.0), np.full(m, 1.0 if at_tip else 0.0)]),
        along=np.concatenate([deployed.xi, drum.xi]),
        **joined,
    )


def _points(shapes: MemberShapes, at: Places, moved: Array) -> dict[str, Array]:
    """Places, shapes and what the material moves by; moved: rate of xi of the material over that of ln L, (k,)."""
    L, along = shapes.reference, moved[:, None, None]
    value, inverse = at.values[0], L * at.values[-1][:, :, 1:]
    return {
        "base": value[:, :, 0],
        "phi": value[:, :, 1:],
        "phi_inverse": inverse,
        "drift": along * at.slopes[0][:, :, 1:],
        "drift_inverse": along * L * at.slopes[-1][:, :, 1:] - inverse,
    }
