"""Rigid bodies in water: buoyancy, added mass, drag, and waves by the formulas of small bodies or by wave data.

At the marker, in its axes, with nu = (v - u, omega), M the added mass, p = M_v nu and L = M_omega nu (Kirchhoff):

    force  -(dp/dt + omega x p),    torque  -(dL/dt + omega x L + v_r x p)

of which M times the acceleration of the marker is left to the mass matrix. Buoyancy rho g V acts at its centre, and a
waterplane resists heave, roll and pitch about the marker, which lies at the still surface at rest, by the potential

    1/2 rho g e^T [[S, S_y, -S_x], [S_y, S_yy, -S_xy], [-S_x, -S_xy, S_xx]] e,    e = (height, up . y, -up . x)

With wave data waves act by the data's excitation and the body's waves by states of `hydrodynamics.radiation`, both in
the axes of the marker; small motions about the mean place are assumed there.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.effectors.noun import Mounted, whole_body
from femflex.effectors.water.motion import (
    CURRENT_ROW,
    DENSITY,
    EAST,
    GRAVITY,
    K_EAST,
    N_CURRENT,
    N_WAVES,
    NORTH,
    ROWS,
    UP,
    WAVE_ROW,
    current_at,
    height_of,
    water_at,
)
from femflex.effectors.water.water import water_of
from femflex.hydrodynamics import Radiation, WaveData, fitted, read_wave_data
from femflex.hydrodynamics.radiation import ACCURACY
from femflex.kernels.compiled import inner
from femflex.kernels.entries import ACT, entry
from femflex.kernels.lanes import offset
from femflex.kernels.vectors import ZERO, Vector, add, cross, dot, load3, load9, scale, store3, sub, turn, turn_back
from femflex.noun.table import refuse
from femflex.noun.values import Angle, Position, Quantity
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector

# numbers of a body; then rate (n, n), input (n, 6), six pairs X of each wave, and those of the water
N_STATES, BY_DATA, IS_LINEAR, VOLUME, CENTRE, AREAS, TURNS, PLANE, MASS, DAMPING, SEA, FIRST = (
    0, 1, 2, 3, 4, 7, 10, 13, 22, 58, 94, 95,
)  # fmt: skip
SYMMETRIC = 1e-6  # of the largest: difference of a matrix from its transpose
Six = Annotated[tuple[float, ...], Quantity("", (6,), least=0.0)]
SixBySix = Annotated[tuple[tuple[float, ...], ...], Quantity("", (6, 6))]


class WetBody(Mounted, heading="wet_bodies"):
    """A rigid body in water, submerged whole or floating with small motions about its mean place.

    Channels: lift, the buoyancy; drag_x, drag_y, drag_z along inertial axes; wave_x, wave_y, wave_z, the force of
    waves along inertial axes.
    """

    water: str | None = None
    """The water, a name in [water]. Default: the only one."""
    volume: Annotated[float, Quantity("m^3", above=0.0)] | None = None
    """Volume of the water that it displaces at rest. Default: that of the data."""
    center_of_buoyancy: Position | None = None
    """Centre of that volume, in the marker's axes. Default: that of the data, else the marker."""
    added_mass: SixBySix | None = None
    """Added mass about the marker, in its axes: forces along x, y, z and moments about them per acceleration, SI.
    Default: that of the data at infinite frequency, else none."""
    drag_areas: Annotated[tuple[float, float, float], Quantity("m^2", (3,), least=0.0)] = (0.0, 0.0, 0.0)
    """Drag coefficients times areas along x, y and z of the marker."""
    turn_drag: Annotated[tuple[float, float, float], Quantity("N m s^2/rad^2", (3,), least=0.0)] = (0.0, 0.0, 0.0)
    """Moment about x, y and z of the marker per square of the rate."""
    damping: Six = (0.0,) * 6
    """Linear damping along and about x, y and z of the marker, N s/m and N m s/rad."""
    waterplane_area: Annotated[float, Quantity("m^2", least=0.0)] | None = None
    """Area of the waterplane of a floating body, whose marker lies at the still surface at rest. Default: that of the
    data, else none."""
    waterplane_moments: Annotated[tuple[float, float, float], Quantity("m^4", (3,))] | None = None
    """Integrals of y^2, x^2 and x y over the waterplane."""
    data: str | None = None
    """Wave data: a NetCDF file of Capytaine (.nc), or NAME.1 of WAMIT next to NAME.3 and NAME.hst. Their origin is the
    marker, at the still surface, with z upwards."""
    heading: Angle = 0.0
    """Direction of the marker's x axis at rest, from the inertial x axis about the vertical, for waves by data."""

    label = "wet body"
    channels = {"lift": "N"} | {f"{what}_{axis}": "N" for what in ("drag", "wave") for axis in "xyz"}
    accounts = ("energy", "dissipation", "supplied")
    exerts = ("force", "torque")
    writes_all = True

    @model_validator(mode="after")
    def _keys_fit(self) -> WetBody:
        if self.added_mass is not None:
            M = np.array(self.added_mass)
            if np.abs(M - M.T).max() > SYMMETRIC * np.abs(M).max():
                refuse("found an added_mass that is not symmetric")
            if np.linalg.eigvalsh(M).min() < -SYMMETRIC * np.abs(M).max():
                refuse("found an added_mass with a negative eigenvalue, whose energy could be negative")
        if self.waterplane_moments is not None and self.waterplane_area is None:
            refuse("found waterplane_moments without waterplane_area; give both")
        if self.volume is None and self.data is None:
            refuse("found neither volume nor data; say how much water the body displaces")
        return self

    def files(self) -> tuple[tuple[str, str], ...]:
        """(key, name) of the file that it names."""
        return () if self.data is None else (("data", self.data),)

    def parameters(self) -> Array:
        """None but those of `effector`, which depend on the water."""
        return np.zeros(0)

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError for unreadable files, and for waves outside their data."""
        body = whole_body(context, self.body)
        body.marker(self.marker)
        water = water_of(context, self.water)
        sea = water.sea(context)
        data, radiation = self._radiation(context, sea)
        n = 0 if radiation is None else len(radiation.rate)
        volume, centre, plane = self._hydrostatics(data, sea)
        mass = np.zeros((6, 6)) if radiation is None else radiation.infinite
        mass = mass if self.added_mass is None else np.array(self.added_mass)
        head = [n, float(data is not None), 0.0, volume, *centre, *self.drag_areas, *self.turn_drag]
        waves = self._excitation(data, sea)
        rows = [np.zeros(0)] if radiation is None else [radiation.rate.ravel(), radiation.input.ravel()]
        body_rows = np.concatenate([plane.ravel(), mass.ravel(), np.diag(self.damping).ravel()])
        place = FIRST + sum(row.size for row in rows) + waves.size
        parameters = np.concatenate([head, body_rows, [place], *rows, waves.ravel(), sea])

        states = {f"radiation_{k + 1}": "J^0.5" for k in range(n)}
        note = f"waves on {name!r}" if water.waves else ""
        drag = (
            ""
            if water.current or not any(self.drag_areas)
            else f"drag of {name!r}, which has no slope in water at rest"
        )
        effector = Effector(
            name, self.act, self.markers(), states=states, channels=self.channels, accounts=self.accounts,
            exerts=self.exerts, parameters=parameters, kind=self.label, added_mass=body_mass, linear=_linear,
            linear_note=", ".join(filter(None, (note, drag))),
        )  # fmt: skip
        return effector

    def _radiation(self, context: Context, sea: Array) -> tuple[WaveData | None, Radiation | None]:
        if self.data is None:
            return None, None
        path = context.folder / self.data
        try:
            data, radiation = _fitted_file(path, path.stat().st_mtime, sea[DENSITY], sea[GRAVITY])
        except OSError as error:
            raise ValueError(f"found data = {self.data!r}, which cannot be read: {error.strerror or error}") from error
        if radiation.error > ACCURACY:
            raise ValueError(
                f"radiation of {self.data!r} is met within {100 * radiation.error:.2g} % only, and 2 % are needed; "
                "give data without irregular frequencies, from low ones to where damping has died away"
            )
        return data, radiation

    def _hydrostatics(self, data: WaveData | None, sea: Array) -> tuple[float, Array, Array]:
        """Volume, its centre (3,), and the stiffness (3, 3) of the waterplane over height, roll and pitch."""
        volume = self.volume if data is None or data.volume is None or self.volume is not None else data.volume
        if volume is None:
            raise ValueError(f"the data {self.data!r} do not say the displaced volume; give volume")
        centre = np.zeros(3)
        if data is not None and data.buoyancy_center is not None:
            centre = np.asarray(data.buoyancy_center, float)
        if self.center_of_buoyancy is not None:
            centre = np.array(self.center_of_buoyancy)
        weight, plane = sea[DENSITY] * sea[GRAVITY], np.zeros((3, 3))
        if self.waterplane_area is not None:
            yy, xx, xy = self.waterplane_moments or (0.0, 0.0, 0.0)
            plane = weight * np.array([[self.waterplane_area, 0.0, 0.0], [0.0, yy, -xy], [0.0, -xy, xx]])
        elif data is not None and data.stiffness is not None:
            if data.mass_center is None:
                raise ValueError(
                    f"the data {self.data!r} have a stiffness, and not the centre of mass with which it was found; "
                    "give waterplane_area and waterplane_moments"
                )
            plane = data.stiffness[2:5, 2:5].copy()
            arm = weight * volume * (centre[2] - float(data.mass_center[2]))
            plane[1, 1], plane[2, 2] = plane[1, 1] - arm, plane[2, 2] - arm
        return volume, centre, plane

    def _excitation(self, data: WaveData | None, sea: Array) -> Array:
        """Real and imaginary parts (n, 6, 2) of the force of each wave. Raises ValueError outside the data."""
        count = int(sea[N_WAVES])
        if data is None or not count:
            return np.zeros(0)
        first = ROWS + CURRENT_ROW * int(sea[N_CURRENT])
        rows = sea[first:].reshape(count, WAVE_ROW)
        east = sea[EAST : EAST + 3], sea[NORTH : NORTH + 3]
        out = []
        for amplitude, k_east, k_north, _, omega, _ in rows:
            along = k_east * east[0] + k_north * east[1]
            heading = (
                math.atan2(float(along @ sea[NORTH : NORTH + 3]), float(along @ sea[EAST : EAST + 3])) - self.heading
            )
            X = amplitude * data.excitation_at(omega, heading)
            out.append(np.stack([X.real, X.imag], axis=1))
        return np.array(out)


def _linear(effector: Effector) -> Effector:
    """The effector without waves, its drag to first order in velocities."""
    changed = effector.parameters.copy()
    changed[IS_LINEAR] = 1.0
    return replace(effector, parameters=changed, linear=None)


@lru_cache(maxsize=8)
def _fitted_file(path: Path, changed: float, density: float, gravity: float) -> tuple[WaveData, Radiation]:
    """The data of a file, last changed at a time, and their radiation: found once in a process."""
    data = read_wave_data(path, density, gravity)
    return data, fitted(data)


@inner
def mass_times(M: Array, v: Vector, w: Vector) -> tuple[Vector, Vector]:
    """Force and moment M (v, w) of a matrix (6, 6)."""
    rows = (0, 6, 12, 18, 24, 30)
    x = (
        dot(load3(M, rows[0]), v) + dot(load3(M, rows[0] + 3), w),
        dot(load3(M, rows[1]), v) + dot(load3(M, rows[1] + 3), w),
        dot(load3(M, rows[2]), v) + dot(load3(M, rows[2] + 3), w),
    )
    y = (
        dot(load3(M, rows[3]), v) + dot(load3(M, rows[3] + 3), w),
        dot(load3(M, rows[4]), v) + dot(load3(M, rows[4] + 3), w),
        dot(load3(M, rows[5]), v) + dot(load3(M, rows[5] + 3), w),
    )
    return x, y


@inner
def excitation(t: float, r: Vector, p: Array, w: Array) -> tuple[Vector, Vector]:
    """Force and moment of all waves by the data, in the marker's axes, at the horizontal place of the marker."""
    n = int(p[N_STATES])
    rows, first = FIRST + n * n + 6 * n, ROWS + CURRENT_ROW * int(w[N_CURRENT])
    x, y, force, torque = dot(load3(w, EAST), r), dot(load3(w, NORTH), r), ZERO, ZERO
    for j in range(int(w[N_WAVES])):
        c = first + WAVE_ROW * j
        theta = w[c + K_EAST] * x + w[c + K_EAST + 1] * y - w[c + 4] * t + w[c + 5]
        cosine, sine = math.cos(theta), math.sin(theta)
        X = rows + 12 * j
        force = add(force, (
            p[X] * cosine - p[X + 1] * sine, p[X + 2] * cosine - p[X + 3] * sine, p[X + 4] * cosine - p[X + 5] * sine,
        ))  # fmt: skip
        torque = add(torque, (
            p[X + 6] * cosine - p[X + 7] * sine,
            p[X + 8] * cosine - p[X + 9] * sine,
            p[X + 10] * cosine - p[X + 11] * sine,
        ))  # fmt: skip
    return force, torque


@inner
def each_drag(u: Vector, v: Vector, c: Vector, is_linear: bool) -> Vector:
    """c |u - v| (u - v) along each axis, or to first order in v."""
    if is_linear:
        return (
            c[0] * abs(u[0]) * (u[0] - 2.0 * v[0]),
            c[1] * abs(u[1]) * (u[1] - 2.0 * v[1]),
            c[2] * abs(u[2]) * (u[2] - 2.0 * v[2]),
        )
    s = sub(u, v)
    return c[0] * abs(s[0]) * s[0], c[1] * abs(s[1]) * s[1], c[2] * abs(s[2]) * s[2]


@WetBody.kernel
def wet_body(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Force and torque on the marker, and the rates of the states of radiation."""
    p = parameters
    n, w = int(p[N_STATES]), offset(p, int(p[SEA]))
    r, C, velocity, rate = load3(seen, 0), load9(seen, 3), load3(seen, 12), load3(seen, 15)
    v, omega, up = turn_back(C, velocity), turn_back(C, rate), turn_back(C, load3(w, UP))
    centre, is_linear, by_data = load3(p, CENTRE), p[IS_LINEAR] > 0.0, p[BY_DATA] > 0.0
    u, du = current_at(height_of(r, w), w), ZERO
    if not is_linear and not by_data:
        u, du, _, _ = water_at(t, add(r, turn(C, centre)), velocity, w)
    u, du = turn_back(C, u), turn_back(C, du)
    relative = sub(v, u)
    # Kirchhoff: what is left of the rates of p and L without the acceleration of the marker
    momentum, spin = mass_times(offset(p, MASS), relative, omega)
    carried, turned = mass_times(offset(p, MASS), add(cross(omega, relative), du), ZERO)
    # d(v - u)/dt in the marker's axes is C^T (a - du/dt) - omega x (v - u)
    force, torque = (
        sub(carried, cross(omega, momentum)),
        sub(turned, add(cross(omega, spin), cross(relative, momentum))),
    )
    # buoyancy and waterplane
    lift = w[DENSITY] * w[GRAVITY] * p[VOLUME]
    buoyancy = scale(lift, up)
    e = (height_of(r, w), up[1], -up[0])
    K_e = turn(load9(p, PLANE), e)
    force = add(force, sub(buoyancy, scale(K_e[0], up)))
    torque = add(torque, add(cross(centre, buoyancy), cross(up, (-K_e[2], K_e[1], 0.0))))
    # drag
    half = 0.5 * w[DENSITY]
    drag = each_drag(u, v, scale(half, load3(p, AREAS)), is_linear)
    moment = each_drag(ZERO, omega, load3(p, TURNS), is_linear)
    slow, slow_moment = mass_times(offset(p, DAMPING), relative, omega)
    drag, moment = sub(drag, slow), sub(moment, slow_moment)
    force, torque = add(force, drag), add(torque, moment)
    # waves
    push, twist = ZERO, ZERO
    if not is_linear:
        if by_data:
            push, twist = excitation(t, r, p, w)
        else:
            push = scale(w[DENSITY] * p[VOLUME], du)
            twist = cross(centre, push)
    force, torque = add(force, push), add(torque, twist)
    # radiation
    stored = lost = 0.0
    inputs = FIRST + n * n
    for i in range(n):
        row = inputs + 6 * i
        force = sub(force, scale(z[i], load3(p, row)))
        torque = sub(torque, scale(z[i], load3(p, row + 3)))
        zdot = dot(load3(p, row), v) + dot(load3(p, row + 3), omega)
        for k in range(n):
            zdot += p[FIRST + n * i + k] * z[k]
            lost -= z[i] * p[FIRST + n * i + k] * z[k]
        out[6 + i] = zdot
        stored += 0.5 * z[i] * z[i]
    lost -= dot(drag, relative) + dot(moment, omega)
    own, own_spin = mass_times(offset(p, MASS), v, omega)
    held = dot(up, centre) + e[0]
    stored += 0.5 * (dot(own, v) + dot(own_spin, omega)) - lift * held + 0.5 * dot(K_e, e)
    # rates of these energies but for the acceleration of the marker
    up_rate = cross(up, omega)
    e_rate = (dot(up, v), up_rate[1], -up_rate[0])
    brought = -dot(own, cross(omega, v)) - lift * (dot(up_rate, centre) + e_rate[0]) + dot(K_e, e_rate)
    for i in range(n):
        row = inputs + 6 * i
        brought += z[i] * (dot(load3(p, row), v) + dot(load3(p, row + 3), omega))
        for k in range(n):
            brought += z[i] * p[FIRST + n * i + k] * z[k]
    brought += lost + dot(force, v) + dot(torque, omega)
    store3(out, 0, turn(C, force))
    store3(out, 3, turn(C, torque))
    first = 6 + n
    out[first] = lift - K_e[0]
    store3(out, first + 1, turn(C, drag))
    store3(out, first + 4, turn(C, push))
    out[first + 7], out[first + 8], out[first + 9], out[first + 10] = stored, lost, brought, 0.0


@entry(ACT)
def body_mass(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Added mass of the body, turned to inertial axes block by block."""
    p, C = parameters, load9(seen, 3)
    for block in range(4):
        at = 18 * (block // 2) + 3 * (block % 2)
        for i in range(3):
            for j in range(3):
                total = 0.0
                for a in range(3):
                    for b in range(3):
                        total += C[3 * i + a] * p[MASS + at + 6 * a + b] * C[3 * j + b]
                out[at + 6 * i + j] = total
