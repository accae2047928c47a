"""Motion of water at a place: linear (Airy) waves with Wheeler's stretching in finite depth, and current over depth.

A component of amplitude a, wave number k along a horizontal direction and frequency omega^2 = g k tanh(k h) has, with
theta = k x - omega t + phase and z upwards from the still surface,

    eta = a cos theta,    u = a omega cosh(k (z' + h)) / sinh(k h) cos theta,
    w = a omega sinh(k (z' + h)) / sinh(k h) sin theta

at the stretched height z' = h (z - eta) / (h + eta) (Wheeler 1970), eta of all components together. The water's
acceleration is d/dt at the place. Waves do not feel the current.
"""

from __future__ import annotations

import math

from femflex.arrays import Array
from femflex.kernels.compiled import inner
from femflex.kernels.lanes import offset
from femflex.kernels.vectors import ZERO, Vector, add, dot, load3, scale

# numbers of the water: density, gravity, height of the still surface; up, and two horizontal directions; the floor
DENSITY, GRAVITY, LEVEL, DEPTH, UP, EAST, NORTH, NORMAL = 0, 1, 2, 3, 4, 7, 10, 13
FLOOR_STIFFNESS, FLOOR_DAMPING, FRICTION, FRICTION_SPEED, N_CURRENT, N_WAVES, ROWS = 16, 17, 18, 19, 20, 21, 22
SOFT = 1e-3  # m, over which damping of the floor sets in, so that touching it is no jump
CURRENT_ROW, WAVE_ROW = 4, 6  # height, velocity (3); amplitude, k along EAST and NORTH, k, omega, phase
AMPLITUDE, K_EAST, K_NORTH, K, OMEGA, PHASE = range(6)


@inner
def height_of(r: Vector, w: Array) -> float:
    """Height of a place above the still surface [m]."""
    return dot(load3(w, UP), r) - w[LEVEL]


@inner
def current_at(z: float, w: Array) -> Vector:
    """Velocity of the current at a height, by straight lines between its rows, which fall; constant beyond them."""
    n = int(w[N_CURRENT])
    if n == 0:
        return ZERO
    if z >= w[ROWS]:
        return load3(w, ROWS + 1)
    for k in range(1, n):
        row = ROWS + CURRENT_ROW * k
        if z >= w[row]:
            share = (w[row - CURRENT_ROW] - z) / (w[row - CURRENT_ROW] - w[row])
            above, below = load3(w, row - CURRENT_ROW + 1), load3(w, row + 1)
            return add(scale(1.0 - share, above), scale(share, below))
    return load3(w, ROWS + CURRENT_ROW * (n - 1) + 1)


@inner
def stretched(c: Array, z: float, depth: float) -> tuple[float, float]:
    """cosh(k (z + h)) / sinh(k h) and sinh(k (z + h)) / sinh(k h) of a component, without overflow."""
    near, far = math.exp(c[K] * z), math.exp(-c[K] * (z + 2.0 * depth))
    whole = 1.0 - math.exp(-2.0 * c[K] * depth)
    return (near + far) / whole, (near - far) / whole


@inner
def water_at(t: float, r: Vector, v: Vector, w: Array) -> tuple[Vector, Vector, float, float]:
    """Velocity and acceleration of the water at a place r, and its surface above still water with its rate along v.

    The last two are those of the surface above or below a point that moves with v.
    """
    up, east, north = load3(w, UP), load3(w, EAST), load3(w, NORTH)
    z, n = height_of(r, w), int(w[N_WAVES])
    velocity, acceleration, eta, rate = current_at(z, w), ZERO, 0.0, 0.0
    first = ROWS + CURRENT_ROW * int(w[N_CURRENT])
    if n == 0:
        return velocity, acceleration, eta, rate
    x, y, v_x, v_y, h = dot(east, r), dot(north, r), dot(east, v), dot(north, v), w[DEPTH]
    for j in range(n):
        c = offset(w, first + WAVE_ROW * j)
        theta = c[K_EAST] * x + c[K_NORTH] * y - c[OMEGA] * t + c[PHASE]
        eta += c[AMPLITUDE] * math.cos(theta)
        rate += c[AMPLITUDE] * (c[OMEGA] - c[K_EAST] * v_x - c[K_NORTH] * v_y) * math.sin(theta)
    lowered = min(0.0, h * ((z - eta) / (h + eta)))
    u = rising = du = falling = u_n = du_n = 0.0
    for j in range(n):
        c = offset(w, first + WAVE_ROW * j)
        theta = c[K_EAST] * x + c[K_NORTH] * y - c[OMEGA] * t + c[PHASE]
        cosine, sine = math.cos(theta), math.sin(theta)
        level, upright = stretched(c, lowered, h)
        speed = c[AMPLITUDE] * c[OMEGA]
        along, across = c[K_EAST] / c[K], c[K_NORTH] / c[K]
        u, u_n = u + along * speed * level * cosine, u_n + across * speed * level * cosine
        du += along * speed * c[OMEGA] * level * sine
        du_n += across * speed * c[OMEGA] * level * sine
        rising += speed * upright * sine
        falling -= speed * c[OMEGA] * upright * cosine
    velocity = add(velocity, add(scale(rising, up), add(scale(u, east), scale(u_n, north))))
    acceleration = add(scale(falling, up), add(scale(du, east), scale(du_n, north)))
    return velocity, acceleration, eta, rate


@inner
def orbital_speed(r: Vector, w: Array) -> float:
    """Root mean square of the water's horizontal speed by waves at a place [m/s]."""
    z, h, square = min(0.0, height_of(r, w)), w[DEPTH], 0.0
    first = ROWS + CURRENT_ROW * int(w[N_CURRENT])
    for j in range(int(w[N_WAVES])):
        c = offset(w, first + WAVE_ROW * j)
        level, _ = stretched(c, z, h)
        square += 0.5 * (c[AMPLITUDE] * c[OMEGA] * level) ** 2
    return math.sqrt(square)


@inner
def floor_force(r: Vector, v: Vector, length: float, diameter: float, w: Array) -> tuple[Vector, float, float, float]:
    """Force of the sea floor on a piece of a line: force, its normal part, stored energy, and power that it loses.

    The floor bears the axis: stiffness and damping per area of length times diameter, the latter from a millimetre on,
    and friction by the normal force.
    """
    n = load3(w, NORMAL)
    depth = -(dot(n, r) - w[LEVEL] * dot(n, load3(w, UP)) + w[DEPTH] * dot(n, load3(w, UP)))
    if not (depth > 0.0 and w[FLOOR_STIFFNESS] > 0.0):
        return ZERO, 0.0, 0.0, 0.0
    rate, area = dot(n, v), length * diameter
    elastic = area * w[FLOOR_STIFFNESS] * depth
    pressed = max(0.0, elastic - area * w[FLOOR_DAMPING] * depth / (depth + SOFT) * rate)
    slip = add(v, scale(-rate, n))
    speed = math.sqrt(dot(slip, slip))
    held = 0.0
    if speed > 0.0:
        held = w[FRICTION] * pressed * math.tanh(speed / w[FRICTION_SPEED]) / speed
    lost = held * speed * speed - (pressed - elastic) * rate
    return add(scale(pressed, n), scale(-held, slip)), pressed, 0.5 * elastic * depth, lost
