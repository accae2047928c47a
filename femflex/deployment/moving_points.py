"""Points of mass of a deploying member, from its shapes."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.deployment.material import MaterialPoints
from femflex.deployment.shapes import MemberShapes
from femflex.system import MovingPoints


def moving_points(shapes: MemberShapes, total: float, at_tip: bool) -> MovingPoints:
    """The points of quadrature of the deployed part, and the stowed part at the drum; total: mass of the whole [kg]."""
    deployed = shapes.material_points(*shapes.quadrature)
    drum = shapes.material_points(np.array([1.0 if at_tip else 0.0]), np.ones(1))
    density = shapes.member_mass / shapes.reference
    # material of the deployed part keeps its distance from the end that came out first; the drum keeps its xi
    deployed_points = _points(shapes, deployed, -deployed.xi if at_tip else 1.0 - deployed.xi)
    drum_points = _points(shapes, drum, np.zeros(len(drum.xi)))
    k, m = len(deployed.xi), len(drum.xi)
    joined = {key: np.concatenate([deployed_points[key], drum_points[key]]) for key in deployed_points}
    return MovingPoints(
        direction=shapes.axes.frame[0],
        mass=np.concatenate([np.zeros(k), total * drum.share]),
        density=density * np.concatenate([deployed.share, -drum.share]),
        drawn=np.concatenate([np.full(k, 0.0 if at_tip else 1.0), np.full(m, 1.0 if at_tip else 0.0)]),
        along=np.concatenate([deployed.xi, drum.xi]),
        **joined,
    )


def _points(shapes: MemberShapes, section_points: MaterialPoints, xi_rate: Array) -> dict[str, Array]:
    """Positions, shapes and their drift with the material; xi_rate: rate of its xi over that of ln L, (k,)."""
    L, xi_rates = shapes.reference, xi_rate[:, None, None]
    value, inverse = section_points.values[0], L * section_points.values[-1][:, :, 1:]
    return {
        "base": value[:, :, 0],
        "phi": value[:, :, 1:],
        "phi_inverse": inverse,
        "drift": xi_rates * section_points.slopes[0][:, :, 1:],
        "drift_inverse": xi_rates * L * section_points.slopes[-1][:, :, 1:] - inverse,
    }
