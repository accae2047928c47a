"""Forces of water on a piece of a slender member: Morison's, buoyancy, Kirchhoff's and the sea floor's (THEORY 9).

With v_r = v - u, u and du/dt of the water, t the tangent and P = 1 - t t^T, a piece of wetted length l feels

    drag       rho l (Cd D / 2 |u_n| u_n + pi Cf D / 2 |u_t| u_t)
    pressure   rho A l du/dt, and buoyancy of the submerged volume
    inertia    -d(m P v_r)/dt with m = rho Ca A l, and the couple of m P as t turns

of which -m P a is left to the mass matrix (`Effector.added_mass`). Water inside a flooded member moves across with it.
What crosses the surface brings or takes no momentum: dm/dt v_r is left out.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from femflex.arrays import Array
from femflex.effectors.water.motion import (
    DENSITY,
    FLOOR_STIFFNESS,
    GRAVITY,
    NORMAL,
    UP,
    current_at,
    floor_force,
    height_of,
    orbital_speed,
    water_at,
)
from femflex.effectors.water.wetted import wetted
from femflex.kernels.compiled import inner
from femflex.kernels.vectors import ZERO, Vector, add, cross, dot, load3, scale, sub

# numbers of a member; then those of its pieces, then those of the water
COUNT, DIAMETER, AREA, DISPLACED, ADDED, INSIDE, DRAG, SKIN, IS_LINEAR, SPEED, SEA, HEAD = range(12)
TANGENT, LENGTH, PIECE = 0, 3, 4  # of a piece: tangent in its marker's axes, length
CURRENT, SEA_STATE = -1.0, -2.0  # SPEED of drag that is linearised about the current, or for the waves
STEP = 1e-6  # s, over which the wetted length is told to change


class OnPiece(NamedTuple):
    """Loads and reports of a piece: force, couple, derivative of the water's energy by its tangent; sums of power."""

    force: Vector
    couple: Vector
    by_tangent: Vector
    mass: float
    energy: float
    lost: float
    brought: float
    lifted: float
    drag: Vector
    pressed: float
    wet: float


@inner
def quadratic(u: Vector) -> Vector:
    """|u| u."""
    return scale(math.sqrt(dot(u, u)), u)


@inner
def linear_drag(u: Vector, v: Vector, speed: float) -> Vector:
    """|u - v| (u - v) to first order in v, about the mean flow u; with a speed > 0: |u| u - speed v."""
    size = math.sqrt(dot(u, u))
    if speed > 0.0:
        return sub(scale(size, u), scale(speed, v))
    if size == 0.0:
        return ZERO
    return sub(scale(size - dot(u, v) / size, u), scale(size, v))


@inner
def drag_on(t: Vector, u: Vector, v: Vector, r: Vector, p: Array, w: Array) -> Vector:
    """Drag per wetted length, in the flow u on a piece with tangent t that moves with v."""
    across, along = 0.5 * w[DENSITY] * p[DRAG] * p[DIAMETER], 0.5 * w[DENSITY] * math.pi * p[SKIN] * p[DIAMETER]
    u_t, v_t = scale(dot(u, t), t), scale(dot(v, t), t)
    u_n, v_n = sub(u, u_t), sub(v, v_t)
    if p[IS_LINEAR] > 0.0:
        speed = p[SPEED]
        if speed == SEA_STATE:
            speed = math.sqrt(8.0 / math.pi) * orbital_speed(r, w)
        return add(scale(across, linear_drag(u_n, v_n, speed)), scale(along, linear_drag(u_t, v_t, speed)))
    return add(scale(across, quadratic(sub(u_n, v_n))), scale(along, quadratic(sub(u_t, v_t))))


@inner
def wet_length(t: float, r: Vector, tangent: Vector, length: float, p: Array, w: Array) -> float:
    """Wetted length of a piece."""
    eta = 0.0
    if p[IS_LINEAR] == 0.0:
        _, _, eta, _ = water_at(t, r, ZERO, w)
    depth, t_z = eta - height_of(r, w), dot(load3(w, UP), tangent)
    return wetted(depth, t_z, length, 0.5 * p[DIAMETER])[0]


@inner
def on_piece(
    t: float, r: Vector, tangent: Vector, v: Vector, turning: Vector, length: float, stiff: float, p: Array, w: Array
) -> OnPiece:
    """Forces on a piece at r with this tangent, which moves with v and turns by `turning`, the tangent's rate.

    stiff: 1 for a piece that turns as a whole, whose added mass then has the moment of inertia m l^2 / 12; else 0
    """
    up, radius, rho = load3(w, UP), 0.5 * p[DIAMETER], w[DENSITY]
    u, du, eta, eta_rate = current_at(height_of(r, w), w), ZERO, 0.0, 0.0
    if p[IS_LINEAR] == 0.0:
        u, du, eta, eta_rate = water_at(t, r, v, w)
    depth, t_z = eta - height_of(r, w), dot(up, tangent)
    wet, store, by_t_z = wetted(depth, t_z, length, radius)
    weight = rho * w[GRAVITY] * p[DISPLACED]
    lift, upset = weight * wet, weight * by_t_z
    drag = scale(wet, drag_on(tangent, u, v, r, p, w))
    m, inside, v_r = p[ADDED] * wet, p[INSIDE] * wet, sub(v, u)
    change = add(scale(dot(tangent, v_r), turning), scale(dot(turning, v_r), tangent))  # -dP/dt v_r
    inner_change = add(scale(dot(tangent, v), turning), scale(dot(turning, v), tangent))
    inertia = add(scale(m, add(change, sub(du, scale(dot(du, tangent), tangent)))), scale(inside, inner_change))
    pressure = scale(rho * p[AREA] * wet, du)
    by_tangent = add(scale(-m * dot(tangent, v_r), v_r), scale(-inside * dot(tangent, v), v))
    by_tangent = sub(by_tangent, scale(upset, up))
    force = add(add(scale(lift, up), drag), add(inertia, pressure))
    bottom, pressed, spring, rubbed = ZERO, 0.0, 0.0, 0.0
    if w[FLOOR_STIFFNESS] > 0.0:
        bottom, pressed, spring, rubbed = floor_force(r, v, length, p[DIAMETER], w)
        if p[IS_LINEAR] > 0.0:  # friction holds no small motion
            normal = load3(w, NORMAL)
            bottom = scale(pressed, normal)
    force = add(force, bottom)
    v_n = sub(v, scale(dot(v, tangent), tangent))
    square = dot(v_n, v_n) + stiff * length * length / 12.0 * dot(turning, turning)
    moving = 0.5 * (m + inside) * square
    lost = rubbed - dot(drag, v_r)
    # what the water brings beyond force and couple: the rate of the energy that is counted as stored
    brought = lost + weight * (wet * (eta_rate - dot(up, v)) + by_t_z * dot(up, turning))
    brought -= (m + inside) * dot(v, tangent) * dot(v, turning)
    if w[FLOOR_STIFFNESS] > 0.0 and pressed > 0.0:
        brought += -dot(bottom, v) - rubbed
    if 0.0 < wet < length:
        ahead = add(tangent, scale(STEP, turning))
        more, _, _ = wetted(depth + STEP * (eta_rate - dot(up, v)), dot(up, ahead), length, radius)
        brought += 0.5 * (p[ADDED] + p[INSIDE]) * (more - wet) / STEP * square
    energy = moving + weight * store + spring
    return OnPiece(
        force, cross(tangent, by_tangent), by_tangent, m + inside, energy, lost, brought, lift, drag, pressed, wet
    )
