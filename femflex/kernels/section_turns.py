"""Rotation vector of a beam's section from the twist and the sines of the slopes; its x axis stays on the tangent.

With s = (twist, -w', v') in components whose x axis e lies along the beam, and p = s - e (e.s), the sines,

    theta = s - 1/2 (e.s) e x s + 1/6 |p|^2 p

is right to second order in all and to third in the slopes: those of an axis that keeps its length are sines.
"""

from __future__ import annotations

from femflex.kernels.compiled import inner
from femflex.kernels.vectors import Matrix, Vector, add, cross, dot, scale, sub


@inner
def section_vector(e: Vector, s: Vector) -> Vector:
    """theta."""
    twist = dot(e, s)
    p = sub(s, scale(twist, e))
    return add(sub(s, scale(0.5 * twist, cross(e, s))), scale(dot(p, p) / 6.0, p))


@inner
def section_slope(e: Vector, s: Vector) -> Matrix:
    """F = dtheta / ds."""
    twist, x = dot(e, s), cross(e, s)
    p = sub(s, scale(twist, e))
    b, h = dot(p, p) / 6.0, 0.5 * twist
    return (
        1.0 + b - (0.5 * x[0] + b * e[0]) * e[0] + p[0] * p[0] / 3.0,
        h * e[2] - (0.5 * x[0] + b * e[0]) * e[1] + p[0] * p[1] / 3.0,
        -h * e[1] - (0.5 * x[0] + b * e[0]) * e[2] + p[0] * p[2] / 3.0,
        -h * e[2] - (0.5 * x[1] + b * e[1]) * e[0] + p[1] * p[0] / 3.0,
        1.0 + b - (0.5 * x[1] + b * e[1]) * e[1] + p[1] * p[1] / 3.0,
        h * e[0] - (0.5 * x[1] + b * e[1]) * e[2] + p[1] * p[2] / 3.0,
        h * e[1] - (0.5 * x[2] + b * e[2]) * e[0] + p[2] * p[0] / 3.0,
        -h * e[0] - (0.5 * x[2] + b * e[2]) * e[1] + p[2] * p[1] / 3.0,
        1.0 + b - (0.5 * x[2] + b * e[2]) * e[2] + p[2] * p[2] / 3.0,
    )


@inner
def section_drift(e: Vector, s: Vector, ds: Vector) -> Vector:
    """(dF/dt) ds/dt: acceleration of theta while s does not accelerate."""
    p = sub(s, scale(dot(e, s), e))
    dtwist = dot(e, ds)
    dp = sub(ds, scale(dtwist, e))
    bend = add(scale(2.0 / 3.0 * dot(p, dp), dp), scale(dot(dp, dp) / 3.0, p))
    return sub(bend, scale(dtwist, cross(e, ds)))
