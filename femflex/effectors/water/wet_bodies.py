"""Bodies in water: buoyancy, added mass, drag, and waves by the formulas of small bodies or by wave data.

At the marker, in its axes, with nu = (v - u, omega), M the added mass, p = M_v nu and L = M_omega nu (Kirchhoff):

    force  -(dp/dt + omega x p),    torque  -(dL/dt + omega x L + v_r x p)

of which M times the acceleration of the marker is left to the mass matrix. Buoyancy rho g V acts at its centre, and a
waterplane resists heave, roll and pitch about the marker, which lies at the still surface at rest, by the potential

    1/2 rho g e^T [[S, S_y, -S_x], [S_y, S_yy, -S_xy], [-S_x, -S_xy, S_xx]] e,    e = (height, up . y, -up . x)

With wave data waves act by the data's excitation and the body's waves by states of `hydrodynamics.radiation`, both in
the axes of the marker; small motions about the mean place are assumed there.

Data may have shapes of a flexible body too, which are its coordinates d. Then nu, M, radiation and excitation have
6 + n rows, and the potential has e^T S d + d^T S_d d / 2 more. The weight of the body at rest is in balance with the
water shape by shape, so that d counts from the body as it floats. Forces on coordinates act at markers that these
alone move.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from femflex.arrays import Array
from femflex.body import FlexibleBody, Marker
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
from femflex.noun.problems import suggestion_text
from femflex.noun.table import Table, refuse
from femflex.noun.values import Angle, Count, Position, Quantity
from femflex.system.acting import ALONE, Context
from femflex.system.effector import Effector

# numbers of a body; then, at the places that it holds, rate (n, n), input (n, 6 + m), six and m pairs X of each wave,
# mass (6 + m, 6 + m), of each of its m shapes the stiffness with height, roll, pitch and all shapes, the force that
# holds its weight and the displacement of its marker; and those of the water
N_STATES, N_SHAPES, BY_DATA, IS_LINEAR, VOLUME, CENTRE, AREAS, TURNS, PLANE, DAMPING = 0, 1, 2, 3, 4, 5, 8, 11, 14, 23
RATE, INPUT, WAVES, MASS, SHAPES, SEA, FIRST = 59, 60, 61, 62, 63, 64, 65
SYMMETRIC = 1e-6  # of the largest: difference of a matrix from its transpose
Six = Annotated[tuple[float, ...], Quantity("", (6,), least=0.0)]
SixBySix = Annotated[tuple[tuple[float, ...], ...], Quantity("", (6, 6))]


class DataShape(Table):
    """A motion of the wave data beyond the six of a rigid body, and the coordinate of the body that it is."""

    dof: str | None = None
    """Name of the motion in the data: that of Capytaine, or the number of WAMIT's mode such as "7". Default: the first
    motion beyond the six for the first entry, the next for the second, and so on."""
    coordinate: Annotated[int, Count(1)] | None = None
    """Number of the elastic coordinate of the body, from 1. Default: the place in this list."""
    marker: str | None = None
    """Marker that moves by 1 m along `component` in the data. Default: the data are those of the coordinate itself, the
    shape of unit mass."""
    component: Literal["x", "y", "z"] = "z"
    """Axis of the body."""


class WetBody(Mounted, heading="wet_bodies"):
    """A body in water, submerged whole or floating with small motions about its mean place: rigid, or by `shapes`.

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
    shapes: list[DataShape] = Field(default_factory=list)
    """Motions of the data beyond the six, and which coordinates of the flexible body they are. The marker then stands
    for its place in the body frame. Coordinates that are not listed have no water."""
    data_origin: Position | None = None
    """Place that stands for the marker with `shapes`, body frame. Default: that of the marker."""
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
        if self.shapes and self.data is None:
            refuse("found shapes without data; give the file with their motions")
        if self.data_origin is not None and not self.shapes:
            refuse("found data_origin without shapes; place the marker of a rigid body at the origin of the data")
        if self.shapes and self.added_mass is not None:
            refuse("found added_mass together with shapes, of which the data have it; remove one of them")
        return self

    def files(self) -> tuple[tuple[str, str], ...]:
        """(key, name) of the file that it names."""
        return () if self.data is None else (("data", self.data),)

    def parameters(self) -> Array:
        """None but those of `effector`, which depend on the water."""
        return np.zeros(0)

    def carrier(self, name: str, body: FlexibleBody) -> FlexibleBody:
        """The body with a marker that does not bend, and with others that each move with three coordinates alone."""
        if not self.shapes:
            return body
        place, n = body.marker(self.marker), body.n_modes
        scales = shape_scales(body)
        origin = place.position if self.data_origin is None else np.array(self.data_origin)
        markers = {f".{name}": Marker.at_position(origin, place.orientation, body.n_shapes)}
        for j in range(0, n, 3):
            phi = np.zeros((3, body.n_shapes))
            for k in range(j, min(j + 3, n)):
                phi[:, k] = scales[k] * place.orientation[:, k - j]
            still = markers[f".{name}"]
            markers[f".{name}.{j // 3}"] = Marker(still.position, phi, still.psi, still.orientation)
        return replace(body, markers=body.markers | markers)

    def effector(self, name: str, context: Context = ALONE) -> Effector:
        """The Effector of that name. Raises ValueError for unreadable files, and for waves outside their data."""
        body = whole_body(context, self.body)
        body.marker(self.marker)
        water = water_of(context, self.water)
        sea = water.sea(context)
        data, radiation = self._radiation(context, sea)
        if data is not None and radiation is not None:
            data, radiation = self._over_coordinates(body, data, radiation)
        n = 0 if radiation is None else len(radiation.rate)
        m = 0 if not self.shapes else body.n_modes
        volume, centre, plane = self._hydrostatics(data, sea)
        mass = np.zeros((6, 6)) if radiation is None else radiation.infinite
        mass = mass if self.added_mass is None else np.array(self.added_mass)
        rows = [
            *([np.zeros(0)] * 2 if radiation is None else [radiation.rate, radiation.input]),
            self._excitation(data, sea), mass, self._of_shapes(body, data, sea), sea,
        ]  # fmt: skip
        head = [n, m, float(data is not None), 0.0, volume, *centre, *self.drag_areas, *self.turn_drag, *plane.ravel()]
        head += np.diag(self.damping).ravel().tolist()
        places = FIRST + np.cumsum([0, *(row.size for row in rows[:-1])])
        parameters = np.concatenate([head, places, *(row.ravel() for row in rows)])

        states = {f"radiation_{k + 1}": "J^0.5" for k in range(n)}
        note = f"waves on {name!r}" if water.waves else ""
        drag = (
            ""
            if water.current or not any(self.drag_areas)
            else f"drag of {name!r}, which has no slope in water at rest"
        )
        own: dict[str, Any] = {"added_mass": body_mass} if m == 0 else {"body_mass": mass}
        return Effector(
            name, self.act, self._all_markers(name, m), states=states, channels=self.channels, accounts=self.accounts,
            exerts=self.exerts, parameters=parameters, kind=self.label, linear=_linear,
            linear_note=", ".join(filter(None, (note, drag))), **own,
        )  # fmt: skip

    def _all_markers(self, name: str, m: int) -> tuple[tuple[str, str], ...]:
        if m == 0:
            return self.markers()
        return ((self.body, f".{name}"), *((self.body, f".{name}.{j // 3}") for j in range(0, m, 3)))

    def _over_coordinates(self, body: FlexibleBody, data: WaveData, radiation: Radiation) -> tuple[WaveData, Radiation]:
        """The data and their radiation over the six motions and all coordinates of the body. Raises ValueError."""
        if not self.shapes:
            if data.shapes:
                raise ValueError(
                    f"the data {self.data!r} have {len(data.shapes)} motions beyond the six of a rigid body: "
                    f"{', '.join(data.shapes)}; say in `shapes` which coordinates of the body they are"
                )
            return data, radiation
        J = np.zeros((6 + len(data.shapes), 6 + body.n_modes))
        J[:6, :6] = np.eye(6)
        for k, shape in enumerate(self.shapes):
            dof = shape.dof if shape.dof is not None else next(iter(data.shapes[k:]), f"number {k + 1}")
            if dof not in data.shapes:
                text = suggestion_text(dof, data.shapes)
                raise ValueError(f"shapes[{k}]: the data {self.data!r} have no motion {dof!r}; {text}")
            row, column, moved = 6 + data.shapes.index(dof), 6 + (shape.coordinate or k + 1) - 1, 1.0
            if column >= J.shape[1] or J[row].any() or J[:, column].any():
                raise ValueError(
                    f"shapes[{k}]: motion {dof!r} or coordinate {column - 5} of body {self.body!r} is named twice, or "
                    f"the latter is beyond its {body.n_modes}"
                )
            if shape.marker is not None:
                moved = float(body.marker(shape.marker).phi["xyz".index(shape.component), column - 6])
            if moved == 0.0:
                raise ValueError(
                    f"shapes[{k}]: coordinate {column - 5} of body {self.body!r} does not move marker "
                    f"{shape.marker!r} along {shape.component}"
                )
            J[row, column] = moved
        return data.over_motions(J), radiation.over_motions(J)

    def _of_shapes(self, body: FlexibleBody, data: WaveData | None, sea: Array) -> Array:
        """Numbers (m, 5 + m) of the shapes: stiffness, force that holds the weight, displacement of the marker."""
        if not self.shapes or data is None:
            return np.zeros(0)
        if data.stiffness is None:
            raise ValueError(f"the data {self.data!r} have no hydrostatic stiffness, which shapes need; give NAME.hst")
        m, up = body.n_modes, body.marker(self.marker).orientation[:, 2]
        elastic = data.stiffness[6:, 6:]
        held = sea[GRAVITY] * body.moments.first[1 : 1 + m] @ up
        return np.column_stack([data.stiffness[6:, 2:5], (elastic + elastic.T) / 2, held, shape_scales(body)])

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
        """Real and imaginary parts (n, 6 + m, 2) of the force of each wave. Raises ValueError outside the data."""
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


def shape_scales(body: FlexibleBody) -> Array:
    """Displacement (n,) of the markers that carry the forces on coordinates: as far as the farthest of the others."""
    reach = [np.linalg.norm(marker.phi[:, : body.n_modes], axis=0) for marker in body.markers.values()]
    farthest = np.max(reach, axis=0)
    return np.asarray(np.where(farthest > 0.0, farthest, 1.0 / math.sqrt(body.moments.mass)))


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
def mass_times(M: Array, size: int, v: Vector, w: Vector) -> tuple[Vector, Vector]:
    """Force and moment of the first six rows of M (v, w, 0), a matrix (size, size)."""
    x = (
        dot(load3(M, 0), v) + dot(load3(M, 3), w),
        dot(load3(M, size), v) + dot(load3(M, size + 3), w),
        dot(load3(M, 2 * size), v) + dot(load3(M, 2 * size + 3), w),
    )
    y = (
        dot(load3(M, 3 * size), v) + dot(load3(M, 3 * size + 3), w),
        dot(load3(M, 4 * size), v) + dot(load3(M, 4 * size + 3), w),
        dot(load3(M, 5 * size), v) + dot(load3(M, 5 * size + 3), w),
    )
    return x, y


@inner
def phase(t: float, r: Vector, w: Array, c: int) -> tuple[float, float]:
    """Cosine and sine of the wave whose numbers begin at w[c], at the horizontal place of r."""
    x, y = dot(load3(w, EAST), r), dot(load3(w, NORTH), r)
    theta = w[c + K_EAST] * x + w[c + K_EAST + 1] * y - w[c + 4] * t + w[c + 5]
    return math.cos(theta), math.sin(theta)


@inner
def excitation(t: float, r: Vector, p: Array, w: Array) -> tuple[Vector, Vector]:
    """Force and moment of all waves by the data, in the marker's axes, at the horizontal place of the marker."""
    rows, first, pairs = int(p[WAVES]), ROWS + CURRENT_ROW * int(w[N_CURRENT]), 2 * (6 + int(p[N_SHAPES]))
    force, torque = ZERO, ZERO
    for j in range(int(w[N_WAVES])):
        cosine, sine = phase(t, r, w, first + WAVE_ROW * j)
        X = rows + pairs * j
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
def shape_excitation(t: float, r: Vector, k: int, p: Array, w: Array) -> float:
    """Force of all waves by the data on coordinate k."""
    rows, first, pairs = int(p[WAVES]), ROWS + CURRENT_ROW * int(w[N_CURRENT]), 2 * (6 + int(p[N_SHAPES]))
    total = 0.0
    for j in range(int(w[N_WAVES])):
        cosine, sine = phase(t, r, w, first + WAVE_ROW * j)
        X = rows + pairs * j + 12 + 2 * k
        total += p[X] * cosine - p[X + 1] * sine
    return total


@inner
def shape_motion(k: int, seen: Array, p: Array) -> tuple[float, float]:
    """Coordinate k and its rate, by the marker that it moves relative to the first marker."""
    m = int(p[N_SHAPES])
    markers, j = 1 + (m + 2) // 3, 1 + k // 3
    C, arm = load9(seen, 3 * markers), sub(load3(seen, 3 * j), load3(seen, 0))
    v = sub(load3(seen, 12 * markers + 3 * j), load3(seen, 12 * markers))
    v = sub(v, cross(load3(seen, 15 * markers), arm))
    scaling = p[int(p[SHAPES]) + (5 + m) * k + 4 + m]
    place, rate = turn_back(C, arm), turn_back(C, v)
    if k % 3 == 0:
        return place[0] / scaling, rate[0] / scaling
    if k % 3 == 1:
        return place[1] / scaling, rate[1] / scaling
    return place[2] / scaling, rate[2] / scaling


@inner
def push_shape(k: int, force: float, seen: Array, p: Array, out: Array) -> None:
    """Put a force on coordinate k: at its marker, and against it at the first one, with the couple of both."""
    m = int(p[N_SHAPES])
    markers, j = 1 + (m + 2) // 3, 1 + k // 3
    f = force / p[int(p[SHAPES]) + (5 + m) * k + 4 + m]
    along = (f if k % 3 == 0 else 0.0, f if k % 3 == 1 else 0.0, f if k % 3 == 2 else 0.0)
    push, arm = turn(load9(seen, 3 * markers), along), sub(load3(seen, 3 * j), load3(seen, 0))
    store3(out, 3 * j, add(load3(out, 3 * j), push))
    store3(out, 0, sub(load3(out, 0), push))
    store3(out, 3 * markers, sub(load3(out, 3 * markers), cross(arm, push)))


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
    """Force and torque on the marker, forces on coordinates, and the rates of the states of radiation."""
    p = parameters
    n, m, w = int(p[N_STATES]), int(p[N_SHAPES]), offset(p, int(p[SEA]))
    markers, size = 1 + (m + 2) // 3, 6 + m
    mass, shapes, wide = offset(p, int(p[MASS])), int(p[SHAPES]), 5 + m
    r, C = load3(seen, 0), load9(seen, 3 * markers)
    velocity, rate = load3(seen, 12 * markers), load3(seen, 15 * markers)
    v, omega, up = turn_back(C, velocity), turn_back(C, rate), turn_back(C, load3(w, UP))
    centre, is_linear, by_data = load3(p, CENTRE), p[IS_LINEAR] > 0.0, p[BY_DATA] > 0.0
    u, du = current_at(height_of(r, w), w), ZERO
    if not is_linear and not by_data:
        u, du, _, _ = water_at(t, add(r, turn(C, centre)), velocity, w)
    u, du = turn_back(C, u), turn_back(C, du)
    relative = sub(v, u)
    # Kirchhoff: what is left of the rates of p and L without the acceleration of the marker
    momentum, spin = mass_times(mass, size, relative, omega)
    own, own_spin = mass_times(mass, size, v, omega)
    for k in range(m):
        _, speed = shape_motion(k, seen, p)
        along, about = scale(speed, load3(mass, size * (6 + k))), scale(speed, load3(mass, size * (6 + k) + 3))
        momentum, spin = add(momentum, along), add(spin, about)
        own, own_spin = add(own, along), add(own_spin, about)
    # d(v - u)/dt in the marker's axes is C^T (a - du/dt) - omega x (v - u)
    change = add(cross(omega, relative), du)
    carried, turned = mass_times(mass, size, change, ZERO)
    force, torque = (
        sub(carried, cross(omega, momentum)),
        sub(turned, add(cross(omega, spin), cross(relative, momentum))),
    )
    # buoyancy and waterplane
    lift = w[DENSITY] * w[GRAVITY] * p[VOLUME]
    buoyancy = scale(lift, up)
    e = (height_of(r, w), up[1], -up[0])
    K_e = turn(load9(p, PLANE), e)
    for k in range(m):
        K_e = add(K_e, scale(shape_motion(k, seen, p)[0], load3(p, shapes + wide * k)))
    force = add(force, sub(buoyancy, scale(K_e[0], up)))
    torque = add(torque, add(cross(centre, buoyancy), cross(up, (-K_e[2], K_e[1], 0.0))))
    # drag
    half = 0.5 * w[DENSITY]
    drag = each_drag(u, v, scale(half, load3(p, AREAS)), is_linear)
    moment = each_drag(ZERO, omega, load3(p, TURNS), is_linear)
    slow, slow_moment = mass_times(offset(p, DAMPING), 6, relative, omega)
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
    stored, lost, rates, inputs = 0.0, -dot(drag, relative) - dot(moment, omega), int(p[RATE]), int(p[INPUT])
    brought = 0.0
    for i in range(n):
        row = inputs + size * i
        force = sub(force, scale(z[i], load3(p, row)))
        torque = sub(torque, scale(z[i], load3(p, row + 3)))
        zdot = dot(load3(p, row), v) + dot(load3(p, row + 3), omega)
        for k in range(m):
            zdot += p[row + 6 + k] * shape_motion(k, seen, p)[1]
        for k in range(n):
            zdot += p[rates + n * i + k] * z[k]
            lost -= z[i] * p[rates + n * i + k] * z[k]
        out[6 * markers + i] = zdot
        stored += 0.5 * z[i] * z[i]
        brought += z[i] * zdot
    held = dot(up, centre) + e[0]
    stored += 0.5 * (dot(own, v) + dot(own_spin, omega) + dot(K_e, e)) - lift * held
    # rates of these energies but for the acceleration of the marker
    up_rate = cross(up, omega)
    e_rate = (dot(up, v), up_rate[1], -up_rate[0])
    brought += lost - dot(own, cross(omega, v)) - lift * (dot(up_rate, centre) + e_rate[0]) + dot(K_e, e_rate)
    brought += dot(force, v) + dot(torque, omega)
    for k in range(3 * markers):
        out[k] = out[3 * markers + k] = 0.0
    store3(out, 0, turn(C, force))
    store3(out, 3 * markers, turn(C, torque))
    for k in range(m):
        amplitude, speed = shape_motion(k, seen, p)
        row, shape = size * (6 + k), shapes + wide * k
        strain = dot(load3(p, shape), e)
        momentum_k = dot(load3(mass, row), v) + dot(load3(mass, row + 3), omega)
        elastic = 0.0
        for j in range(m):
            other, other_speed = shape_motion(j, seen, p)
            elastic += p[shape + 3 + j] * other
            momentum_k += mass[row + 6 + j] * other_speed
        on_shape = dot(load3(mass, row), change) - strain - elastic
        if not is_linear:
            on_shape += shape_excitation(t, r, k, p, w)
        for i in range(n):
            on_shape -= z[i] * p[inputs + size * i + 6 + k]
        # the force that holds the weight is minus that of gravity at rest, whose energy is linear in the coordinate
        hold = p[shape + 3 + m]
        push_shape(k, on_shape + hold, seen, p, out)
        stored += 0.5 * (momentum_k * speed + (strain + elastic) * amplitude) - hold * amplitude
        brought += (strain + elastic) * speed + on_shape * speed
    first = 6 * markers + n
    out[first] = lift - K_e[0]
    store3(out, first + 1, turn(C, drag))
    store3(out, first + 4, turn(C, push))
    out[first + 7], out[first + 8], out[first + 9], out[first + 10] = stored, lost, brought, 0.0


@entry(ACT)
def body_mass(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Added mass of a body without shapes, turned to inertial axes block by block."""
    p, C, mass = parameters, load9(seen, 3), int(parameters[MASS])
    for block in range(4):
        at = 18 * (block // 2) + 3 * (block % 2)
        for i in range(3):
            for j in range(3):
                total = 0.0
                for a in range(3):
                    for b in range(3):
                        total += C[3 * i + a] * p[mass + at + 6 * a + b] * C[3 * j + b]
                out[at + 6 * i + j] = total
