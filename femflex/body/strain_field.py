"""Strain fields: rows that give strain and strain energy at points of a body from its elastic coordinates.

A field is a tuple of parts, one per member and element layout. Pictures coloured by strain are made from it, and it is
stored with the body in body files and result files.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, IntArray

if TYPE_CHECKING:
    import h5py


NAMES = {
    "line": ("axial", "curvature_z", "curvature_y", "twist"),
    "plate": (
        *("membrane_xx", "membrane_yy", "membrane_xy"),
        *("curvature_xx", "curvature_yy", "curvature_xy", "shear_x", "shear_y"),
    ),
    "solid": ("xx", "yy", "zz", "yz", "xz", "xy"),
}
ARRAYS = {  # name -> (description, units); those of rows hold for mass-normalised shapes
    "places": ("undeformed places of the points, body frame", "m"),
    "weight": ("length, area or volume that each point stands for", "m | m^2 | m^3"),
    "rows": ("generalised gradients g: point, gradient, shape", "kg^-1/2 m^-1 | kg^-1/2 m^-2"),
    "linear": ("strain, per gradient", "1"),
    "quadratic": ("quadratic strain, eps = linear g + 1/2 g.quadratic g", "1"),
    "elastic": ("elastic matrix, of every point or of all", "N | N m | N m^2 | N/m | N/m^2"),
    "stress": ("initial stress, of every point or of all", "N | N m | N/m | N/m^2"),
    "lever": ("polar radius of lines, half the thickness of plates, of every point or of all", "m"),
    "fibres": ("stress of extreme fibres per axial force, moments and torque, of every point or of all", "m^-2 | m^-3"),
    "plies": (
        "stress 11, 22, 12 in the axes of each ply of plates at its bottom and top, per membrane strain and curvature, "
        "of every point or of all",
        "N/m^2 | N/m",
    ),
    "first": ("part of the amplitudes that is of first order in the energy", "1"),
}


@dataclass(frozen=True, eq=False)
class StrainPart:
    """Strain of one member at points: eps = linear g + 1/2 g.quadratic g, g = rows y over the amplitudes y of shapes.

    kind       "line", "plate" or "solid": the energy density is per length, area or volume
    places     (p, 3)       undeformed, body frame [m]
    weight     (p,)         length, area or volume that each point stands for
    rows       (p, g, n)    generalised gradients per shape, in single precision
    linear     (s, g);  quadratic  (s, g, g)
    elastic    (1|p, s, s);  stress  (1|p, s)  the initial one
    first      (n, n)       the part of first order of the amplitudes; the rest is of second order (stretch of
                            condensed bodies, and dependent shapes), and products of two amplitudes of second order
                            are left out, as in the energy
    nonlinear  whether the body's strain keeps the quadratic part; otherwise only the initial stress works on it
    lever      (1|p,)       polar radius of a line's section, with which twist is carried; half a plate's thickness [m]
    fibres     (0|1|p, 4)   of lines: stress of the extreme fibres per axial force, moment_z, moment_y and torque
                            [1/m^2, 1/m^3], the last NaN where the section is not round; none where not known
    plies      (0|1|p, k, 2, 3, 6)  of plates: stress 11, 22, 12 in the axes of each ply, from the lowest on, at its
                            bottom and top, per membrane strain and curvature [N/m^2, N/m]; none where not known
    group      the member's group of the mesh; "" where not known
    per        points of each element, which follow each other; 1 where every point stands alone

    The strains are those of NAMES[kind], in this order; twist is the twist rate times the section's polar radius. Of
    beams, curvatures hold products of bend and twist so that their energy is right (`femflex.fem.beam.strain`).
    """

    kind: str
    places: Array
    weight: Array
    rows: NDArray[np.float32]
    linear: Array
    quadratic: Array
    elastic: Array
    stress: Array
    first: Array
    nonlinear: bool
    per: int = 1
    lever: Array = field(default_factory=lambda: np.zeros(1))
    fibres: Array = field(default_factory=lambda: np.zeros((0, 4)))
    plies: Array = field(default_factory=lambda: np.zeros((0, 0, 2, 3, 6)))
    group: str = ""

    def __post_init__(self) -> None:
        if self.kind not in NAMES:
            raise ValueError(f"a part of a strain field is of kind {self.kind!r}; known are {', '.join(NAMES)}")
        (p, g, n), s = self.rows.shape if self.rows.ndim == 3 else (0, 0, 0), len(self.linear)
        shapes = {
            "places": (p, 3), "weight": (p,), "linear": (s, g), "quadratic": (s, g, g), "elastic": (p, s, s),
            "stress": (p, s), "first": (n, n), "lever": (p,), "fibres": (p, 4),
        }  # fmt: skip
        for name, shape in shapes.items():
            actual = getattr(self, name).shape
            if actual not in (shape, (1, *shape[1:]), (0, 4)):
                raise ValueError(f"{name!r} of a strain field has the shape {actual}; expected {shape}")
        if self.plies.ndim != 5 or self.plies.shape[2:] != (2, 3, 6) or len(self.plies) not in (0, 1, p):
            raise ValueError(f"'plies' of a strain field has the shape {self.plies.shape}; expected {(p, 1, 2, 3, 6)}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the strains."""
        return NAMES[self.kind][: len(self.linear)]

    def strains(self, y: Array) -> Array:
        """Strains (t, p, s) at amplitudes (t, n) of all shapes."""
        linear = self._gradients(y) @ self.linear.T
        return linear + self._quadratic(y) if self.nonlinear else linear

    def energy(self, y: Array) -> Array:
        """Strain energy per length, area or volume (t, p), zero at rest: sigma0.eps + 1/2 eps.C eps."""
        linear, quadratic = self._gradients(y) @ self.linear.T, self._quadratic(y)
        eps = linear + quadratic if self.nonlinear else linear
        stored = np.einsum("tps,tps->tp", eps, np.matmul(eps[:, :, None], self.elastic)[:, :, 0]) / 2
        return np.asarray(stored + np.sum(self.stress * (linear + quadratic), axis=2))

    def transformed(self, X: Array, first: Array) -> StrainPart:
        """The same part over the shapes phi X, X (n, m), first (m, m) of which are of first order."""
        return replace(self, rows=(self.rows @ X).astype(np.float32), first=first)

    def with_shapes(self, shapes: IntArray) -> StrainPart:
        """The same part over the selected shapes (k,) alone."""
        return replace(self, rows=self.rows[:, :, shapes], first=self.first[np.ix_(shapes, shapes)])

    def at_point(self, point: Array) -> StrainPart:
        """The same part at one point (3,), body frame [m].

        For lines with several points per element it is on the straight line through the two nearest points of an
        element, with gradients linear between them and up to half their distance beyond; otherwise the nearest point.
        """
        distances = np.linalg.norm(self.places - point, axis=1)
        k = int(np.argmin(distances))
        if self.kind != "line" or self.per < 2:
            return self._weighted(k, k, 0.0)
        first = k - k % self.per
        j = min((i for i in range(first, first + self.per) if i != k), key=lambda i: float(distances[i]))
        segment = self.places[j] - self.places[k]
        return self._weighted(k, j, float(np.clip(segment @ (point - self.places[k]) / (segment @ segment), -0.5, 1.0)))

    def _weighted(self, k: int, j: int, share: float) -> StrainPart:
        """The same part at one point: (1 - share) of point k plus a share of point j."""

        def mean(a: NDArray[Any]) -> NDArray[Any]:
            return ((1.0 - share) * a[k : k + 1] + share * a[j : j + 1]).astype(a.dtype) if len(a) > 1 else a

        same = ("linear", "quadratic", "first")  # at all points
        means: dict[str, Any] = {name: mean(getattr(self, name)) for name in ARRAYS if name not in same}
        return replace(self, per=1, **means)

    def _gradients(self, y: Array) -> Array:
        p, g, n = self.rows.shape
        y = np.asarray(y, float).reshape(-1, n)
        return np.asarray((y @ self.rows.reshape(-1, n).T.astype(float)).reshape(len(y), p, g))

    def _quadratic(self, y: Array) -> Array:
        if not self.quadratic.any():
            return np.zeros((1, 1, len(self.linear)))
        g = self._gradients(np.asarray(y, float).reshape(-1, len(self.first)) @ self.first.T)
        with_second_order = 2 * self._gradients(y) - g  # twice what is of second order: products with it are of third
        out = np.zeros((*g.shape[:2], len(self.linear)))
        for s, i, j in zip(*np.nonzero(self.quadratic), strict=True):
            out[:, :, s] += self.quadratic[s, i, j] / 2 * g[:, :, i] * with_second_order[:, :, j]
        return out


def write_field(group: h5py.Group, field: Sequence[StrainPart]) -> None:
    """Write every part as a group of its own, by number."""
    for number, part in enumerate(field):
        part_group = group.create_group(f"strain_field/{number}")
        part_group.attrs.update({name: getattr(part, name) for name in ("kind", "nonlinear", "per", "group")})
        for name in ARRAYS:
            part_group[name] = getattr(part, name)
            part_group[name].attrs["description"], part_group[name].attrs["units"] = ARRAYS[name]


def read_field(group: h5py.Group) -> tuple[StrainPart, ...]:
    """The parts that write_field wrote, none where it did not."""
    if "strain_field" not in group:
        return ()
    parts: Any = group["strain_field"]
    numbered = [parts[str(number)] for number in range(len(parts))]
    for part_group in numbered:
        if lacking := sorted({*ARRAYS} - {"first", "lever", "fibres", *part_group}):
            raise ValueError(f"a part of the strain field lacks {', '.join(lacking)}")
    return tuple(
        StrainPart(
            kind=str(own.attrs["kind"]),
            nonlinear=bool(own.attrs["nonlinear"]),
            per=int(own.attrs.get("per", 1)),
            first=_first_order(own),
            group=str(own.attrs.get("group", "")),
            **{name: own[name][()] for name in ARRAYS if name in own and name != "first"},
        )
        for own in numbered
    )


def _first_order(part_group: Any) -> Array:
    """`first` of a part; files of femflex before it have the number of shapes of first order, the first ones."""
    if "first" in part_group:
        return np.asarray(part_group["first"][()], float)
    n = part_group["rows"].shape[2]
    return np.diag((np.arange(n) < int(part_group.attrs["leading"])).astype(float))
