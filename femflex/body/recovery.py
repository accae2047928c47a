"""Stress and section forces from the strain field of a body: sigma = sigma0 + C eps at the points of its parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.body.strain_field import StrainPart

RESULTANTS = {  # by kind of member: names and units of the elastic matrix times the strains
    "line": (("axial_force", "moment_z", "moment_y", "torque"), ("N", "N m", "N m", "N m")),
    "plate": (
        ("force_xx", "force_yy", "force_xy", "moment_xx", "moment_yy", "moment_xy", "shear_x", "shear_y"),
        ("N/m", "N/m", "N/m", "N", "N", "N", "N/m", "N/m"),
    ),
    "solid": (("xx", "yy", "zz", "yz", "xz", "xy"), ("Pa",) * 6),
}
SHEAR_FORCES = {"shear_force_y": ("moment_z", -1.0), "shear_force_z": ("moment_y", 1.0)}  # of lines, [N]
_LINE = RESULTANTS["line"][0]
VON_MISES, FIBRE_STRESS = "von_mises", "fibre_stress"
PLY_AXES = ("11", "22", "12")  # stresses of a ply along its axis 1, across it, and shear
ISOTROPY_TOLERANCE = 0.1  # of the largest stiffness, by which a ply's may differ with the direction
SHEET_TOLERANCE = 1e-3  # by which 12 D / (A h^2) of a sheet of one material may differ from 1
CHUNK = 4_000_000  # values in memory at once


@dataclass(frozen=True)
class Peak:
    """The largest value of one quantity of the members of a group: value, time [s], position (3,) [m, body frame].

    group  "" for members whose group is not known: those of a kind then count together
    """

    kind: str
    name: str
    unit: str
    value: float
    time: float
    place: tuple[float, float, float]
    group: str = ""


def resultants(part: StrainPart, y: Array) -> Array:
    """Resultants (t, p, s) of a part at amplitudes y (t, n): those of RESULTANTS, in this order.

    For lines these are axial force, bending moments and torque in the section's axes; for plates and shells forces and
    moments per length in the section's axes; for solids stresses along the axes of the body. Initial stress is
    included.
    """
    names = RESULTANTS[part.kind][0]
    strains = part.strains(y)
    forces = np.einsum("...st,...pt->...ps", part.elastic[0], strains) if len(part.elastic) == 1 else np.einsum(
        "pst,ipt->ips", part.elastic, strains
    )  # fmt: skip
    forces = (forces + part.stress)[..., : len(names)]
    if part.kind == "line" and forces.shape[2] > 3:
        forces[..., 3] *= part.lever  # twist is the twist rate times the section's polar radius
    return np.asarray(forces)


def von_mises(part: StrainPart, y: Array) -> Array | None:
    """Von Mises' equivalent stress (t, p) [Pa] at amplitudes (t, n); None where a part's stress is not known.

    For solids it follows from the stress. For plates of isotropic plies (a plain sheet, a sandwich) it is the largest
    of all faces of plies, and for round beams that of the outermost fibre under axial force, bending and torque. Plies
    of other materials have stresses of their own instead, and other sections their resultants.
    """
    if VON_MISES not in quantities([part]):
        return None
    if part.kind == "line":
        torque = resultants(part, y)[..., 3] * part.fibres[:, 3]
        return np.asarray(np.sqrt(fibre_stress(part, y) ** 2 + 3 * torque**2))
    forces = resultants(part, y)
    if part.kind == "solid":
        xx, yy, zz, yz, xz, xy = np.moveaxis(forces, 2, 0)
        squares = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
        return np.asarray(np.sqrt(squares / 2 + 3 * (yz**2 + xz**2 + xy**2)))
    if part.plies.size:
        xx, yy, xy = np.moveaxis(ply_stresses(part, y), -1, 0)
        return np.asarray(np.sqrt(xx**2 - xx * yy + yy**2 + 3 * xy**2).max(axis=(2, 3)))
    h = 2 * part.lever  # of a file without plies
    faces = []
    for sign in (1.0, -1.0):
        xx, yy, xy = np.moveaxis(forces[..., :3] / h[..., None] + sign * 6 * forces[..., 3:6] / h[..., None] ** 2, 2, 0)
        faces.append(np.sqrt(xx**2 - xx * yy + yy**2 + 3 * xy**2))
    return np.asarray(np.maximum(*faces))


def ply_stresses(part: StrainPart, y: Array, plies: slice = slice(None)) -> Array:
    """Stresses (t, p, k, 2, 3) [Pa] 11, 22, 12 of some plies in their own axes at their bottoms and tops.

    Classical lamination theory: sigma = Q (eps_0 + z kappa), with the strains that the forces and moments of the
    section, initial ones included, belong to.
    """
    n = min(6, len(part.names))
    compliance = np.linalg.inv(part.elastic[:, :n, :n])
    per_force = part.plies[:, plies][..., :n] @ compliance[:, None, None]
    flat = per_force.reshape(len(per_force), -1, n)
    stress = np.matmul(flat, resultants(part, y)[..., :n, None])[..., 0]
    return np.asarray(stress.reshape(*stress.shape[:2], *per_force.shape[1:4]))


def ply_names(part: StrainPart) -> dict[str, tuple[int, int]]:
    """Names of the ply stresses of a part, as in "ply1_11" of the lowest ply: its number and component, from 0.

    Cores without stiffness in the plane have none, nor has a plain sheet of an isotropic material.
    """
    stiff = [k for k in range(part.plies.shape[1]) if part.plies[:, k].any()]
    if part.plies.shape[1] == 1 and has_isotropic_plies(part):
        return {}
    return {f"ply{k + 1}_{name}": (k, c) for k in stiff for c, name in enumerate(PLY_AXES)}


def has_isotropic_plies(part: StrainPart) -> bool:
    """Whether every ply has the same stiffness in all directions of its plane, to a tenth.

    Equal strains along both axes then give equal stresses without shear, and the two shears, (1, -1, 0) and (0, 0, 2),
    equal stresses that are shears too.
    """
    if not part.plies.size:
        return False
    stiffness = part.plies[0, :, 0, :, :3]
    equal, first, second = (
        stiffness @ np.array(strain) for strain in ([1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 2.0])
    )
    size = np.abs(stiffness).max(axis=(1, 2))
    shears = [np.hypot((s[:, 0] - s[:, 1]) / 2, s[:, 2]) for s in (first, second)]
    differ = [equal[:, 0] - equal[:, 1], equal[:, 2], first[:, 0] + first[:, 1], second[:, 0] + second[:, 1]]
    differ.append(shears[0] - shears[1])
    return bool(np.all(np.abs(differ) <= ISOTROPY_TOLERANCE * size))


def fibre_stress(part: StrainPart, y: Array) -> Array:
    """Largest magnitude over the section (t, p) [Pa] of the stress along a line whose fibres are known.

    |N|/A + |M_z| y_max/I_z + |M_y| z_max/I_y, a corner's; of round sections the two moments add as vectors do.
    """
    stress = np.abs(resultants(part, y)) * part.fibres[:, : len(part.names)]
    if stress.shape[2] == 1:  # of rods
        return np.asarray(stress[..., 0])
    bending = np.where(
        np.isnan(part.fibres[:, 3]), stress[..., 1] + stress[..., 2], np.hypot(stress[..., 1], stress[..., 2])
    )
    return np.asarray(stress[..., 0] + bending)


def has_face_stress(part: StrainPart) -> bool:
    """Whether plates have a von Mises stress: all plies are isotropic or, where plies are not known, D = A h^2 / 12, a
    sheet of one material. Membranes, which have no D, have none."""
    if len(part.names) < 6:
        return False
    if part.plies.size:
        return has_isotropic_plies(part)
    h = 2 * part.lever
    A, D = part.elastic[:, 0, 0], part.elastic[:, 3, 3]
    return bool(np.all(h > 0) and np.all(np.abs(12 * D / (A * h**2) - 1) < SHEET_TOLERANCE))


def quantity_by_name(part: StrainPart, name: str, y: Array) -> Array | None:
    """One quantity (t, p) of a part by its name, such as "moment_y" or "von_mises"; None if the part does not have it.

    Shear forces of lines are those that balance the moments: V_y = -dM_z/dx, V_z = dM_y/dx, in the axes of the section.
    They include the load of rotary inertia, and differ from the constitutive ones within elements that are too long.
    Stresses of plies, as "ply1_11", are those of the bottom or the top of the ply, where their magnitude is larger.
    """
    if name == VON_MISES:
        return von_mises(part, y)
    if name == FIBRE_STRESS:
        return fibre_stress(part, y) if len(part.fibres) else None
    if name in SHEAR_FORCES:
        moment, sign = SHEAR_FORCES[name]
        return sign * (resultants(part, y)[..., _LINE.index(moment)] @ _slopes(part)) if _shears(part) else None
    if name in (plies := ply_names(part)):
        k, component = plies[name]
        bottom, top = np.moveaxis(ply_stresses(part, y, slice(k, k + 1))[:, :, 0, :, component], 2, 0)
        return np.where(np.abs(bottom) > np.abs(top), bottom, top)
    names = RESULTANTS[part.kind][0]
    if name not in names or names.index(name) >= len(part.names):
        return None
    return resultants(part, y)[..., names.index(name)]


def _shears(part: StrainPart) -> bool:
    """Whether shear forces of a part follow from its moments."""
    return part.kind == "line" and part.per > 1 and len(part.names) == len(_LINE)


def _slopes(part: StrainPart) -> sparse.csr_array:
    """Matrix (p, p) that takes values (..., p) at the points of a line's elements to their derivatives along them:
    those of the polynomial through the points of each element."""
    x = part.places.reshape(-1, part.per, 3)
    direction = x[:, -1] - x[:, 0]
    span = np.linalg.norm(direction, axis=1)
    s = np.einsum("eqi,ei->eq", x - x[:, :1], direction) / span[:, None] ** 2
    differences = s[:, :, None] - s[:, None, :] + np.eye(part.per)
    weight = 1.0 / differences.prod(axis=2)  # barycentric
    D = weight[:, None, :] / weight[:, :, None] / differences
    D *= 1.0 - np.eye(part.per)
    D -= D.sum(axis=2, keepdims=True) * np.eye(part.per)
    blocks = (D / span[:, None, None]).swapaxes(1, 2)
    return sparse.bsr_array((blocks, np.arange(len(x)), np.arange(len(x) + 1))).tocsr()


def quantities(parts: Sequence[StrainPart]) -> dict[str, str]:
    """Units of all quantities that the parts have, by name."""
    units_by_name: dict[str, str] = {}
    for part in parts:
        names, units = RESULTANTS[part.kind]
        units_by_name |= dict(zip(names[: len(part.names)], units, strict=False))
        if _shears(part):
            units_by_name |= dict.fromkeys(SHEAR_FORCES, "N")
        if len(part.fibres):
            units_by_name[FIBRE_STRESS] = "Pa"
        units_by_name |= dict.fromkeys(ply_names(part), "Pa")
        twisted = len(part.names) == len(_LINE) and len(part.fibres) > 0 and not np.isnan(part.fibres[:, 3]).any()
        if part.kind == "solid" or (has_face_stress(part) if part.kind == "plate" else twisted):
            units_by_name[VON_MISES] = "Pa"
    return units_by_name


def peaks(parts: Sequence[StrainPart], y: Array, time: Array) -> list[Peak]:
    """Largest magnitude of every quantity over points and times (t,) [s], by group and name; amplitudes y (t, n)."""
    best: dict[tuple[str, str, str], Peak] = {}
    for part in parts:
        units = quantities([part])
        for name, (largest, rows) in peaks_over_time(part, y, list(units)).items():
            point = int(np.argmax(largest))
            key = part.kind, part.group, name
            if key not in best or largest[point] > abs(best[key].value):
                x, y_, z = (float(value) for value in part.places[point])
                when_s = float(time[rows[point]])
                best[key] = Peak(part.kind, name, units[name], float(largest[point]), when_s, (x, y_, z), part.group)
    return [best[key] for key in sorted(best, key=lambda key: (list(RESULTANTS).index(key[0]), *key[1:]))]


def at_points(parts: Sequence[StrainPart], name: str, points: ArrayLike, y: Array) -> tuple[Array, Array]:
    """A quantity along time (t, m) at the strain points nearest to points (m, 3), and where these lie (m, 3) [m].

    Raises ValueError with the names known when no part has it.
    """
    nearest = [NearestPoint.find(parts, name, point) for point in np.asarray(points, float).reshape(-1, 3)]
    return np.stack([point.values(y) for point in nearest], axis=1), np.stack([point.position for point in nearest])


@dataclass(frozen=True, eq=False)
class NearestPoint:
    """A quantity at one strain point: the part of its element alone, and the number of the point in it."""

    name: str
    part: StrainPart
    number: int

    @classmethod
    def find(cls, parts: Sequence[StrainPart], name: str, point: ArrayLike) -> NearestPoint:
        """The point nearest to `point` (3,) among the parts that have the quantity; ValueError when none has it."""
        candidates = [part for part in parts if name in quantities([part])]
        if not candidates:
            raise ValueError(f"quantity {name!r} is not known of this body; it has {', '.join(quantities(parts))}")
        distances = [np.linalg.norm(part.places - np.asarray(point, float), axis=1) for part in candidates]
        k = int(np.argmin([each.min() for each in distances]))
        index, per = int(np.argmin(distances[k])), candidates[k].per
        element = index // per
        return cls(name, _at_points(candidates[k], np.arange(element * per, (element + 1) * per)), index % per)

    @property
    def position(self) -> Array:
        """Position of the point (3,) [m, body frame]."""
        return np.asarray(self.part.places[self.number])

    @property
    def unit(self) -> str:
        """Unit of the quantity."""
        return quantities([self.part])[self.name]

    def values(self, y: Array) -> Array:
        """The quantity along time (t,) at amplitudes y (t, n)."""
        values = quantity_by_name(self.part, self.name, y)
        assert values is not None
        return np.asarray(values[:, self.number])


def _at_points(part: StrainPart, points: IntArray) -> StrainPart:
    """The part restricted to some of its points, those of whole elements."""

    def rows(table: Array) -> Array:
        return table if len(table) == 1 else table[points]

    return replace(
        part,
        places=part.places[points],
        weight=part.weight[points],
        rows=part.rows[points],
        elastic=rows(part.elastic),
        stress=rows(part.stress),
        lever=rows(part.lever),
        fibres=rows(part.fibres) if len(part.fibres) else part.fibres,
        plies=rows(part.plies) if len(part.plies) else part.plies,
    )


def peaks_over_time(part: StrainPart, y: Array, names: Sequence[str]) -> dict[str, tuple[Array, IntArray]]:
    """Largest magnitude (p,) of each quantity at each point, and the row (p,) of y where it is; in chunks of time."""
    n = len(part.places)
    largest = {name: np.full(n, -1.0) for name in names}
    when = {name: np.zeros(n, np.int64) for name in names}
    step = max(1, CHUNK // (n * 20))
    for start in range(0, len(y), step):
        for name in names:
            values = quantity_by_name(part, name, y[start : start + step])
            assert values is not None
            values = np.abs(values)
            row = np.argmax(values, axis=0)
            value = values[row, np.arange(n)]
            better = value > largest[name]
            largest[name][better], when[name][better] = value[better], start + row[better]
    return {name: (largest[name], when[name]) for name in names}
