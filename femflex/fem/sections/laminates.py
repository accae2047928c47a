"""Plate sections: the stiffness of a lay-up per unit width, and its mass per unit area.

Every section is a stack of plies; a plain sheet is one ply, a sandwich is three. Strains vary linearly through the
thickness, eps(z) = eps_0 + z kappa, and stresses are plane in each ply. Plates take sections without coupling
(B = 0); shells take any, also off the surface of their nodes.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator

from femflex.arrays import Array
from femflex.fem.sections.materials import Density, Material, Modulus, Orthotropic
from femflex.noun.table import Table, refuse
from femflex.noun.values import Plain, Quantity

SoftModulus = Annotated[float, Quantity("Pa", least=0.0)]  # zero of a core that resists shear only

COUPLING_TOLERANCE = 1e-9  # B relative to sqrt(A D): beyond rounding, the lay-up is not symmetric
_GAUSS = np.polynomial.legendre.leggauss(3)  # exact for the quartic energy of quadratic shear stresses


class Lamina(Table):
    """A material with axes of its own: of plies, with axes 1 and 2 in the plane, or of solids."""

    kind: Literal["orthotropic"] = "orthotropic"
    """Selects this material: orthotropic, for plies and solids."""
    E1: SoftModulus
    """Elastic modulus along axis 1."""
    E2: SoftModulus
    """Elastic modulus along axis 2."""
    G12: SoftModulus
    """In-plane shear modulus."""
    nu12: Plain
    """Poisson's ratio: contraction along 2 under tension along 1."""
    density: Density
    """Mass per volume."""
    G13: Modulus = None  # type: ignore[assignment]
    """Transverse shear modulus in the 1-3 plane. Default: G12."""
    G23: Modulus = None  # type: ignore[assignment]
    """Transverse shear modulus in the 2-3 plane. Default: G12."""
    E3: Modulus | None = None
    """Elastic modulus along axis 3, which solids need."""
    nu13: Plain | None = None
    """Poisson's ratio, which solids need: contraction along 3 under tension along 1."""
    nu23: Plain | None = None
    """Poisson's ratio, which solids need: contraction along 3 under tension along 2."""

    @model_validator(mode="after")
    def _stores_energy(self) -> Lamina:
        for name in ("G13", "G23"):
            if getattr(self, name) is None:
                vars(self)[name] = self.G12
            if not getattr(self, name) > 0.0:
                refuse(f"found {name} = 0; a lamina has a transverse shear modulus above 0 Pa")
        if (self.E1 > 0) != (self.E2 > 0):
            refuse(f"found E1 = {self.E1} and E2 = {self.E2} Pa; give both, or neither (a soft core)")
        if self.E1 > 0 and not self.nu12**2 < self.E1 / self.E2:
            refuse(
                f"nu12 is {self.nu12}, but a material with E1 / E2 = {self.E1 / self.E2:.6g} stores positive energy "
                f"only while nu12^2 is smaller than that ratio"
            )
        return self

    @property
    def solid(self) -> Orthotropic:
        """The material of a solid. Raises ValueError without its third axis."""
        missing = [name for name in ("E3", "nu13", "nu23") if getattr(self, name) is None]
        if self.E3 is None or self.nu13 is None or self.nu23 is None:
            raise ValueError(f"found an orthotropic material without {', '.join(missing)}, which solids need; add them")
        poisson = self.nu12, self.nu13, self.nu23
        return Orthotropic(self.E1, self.E2, self.E3, self.G12, self.G13, self.G23, *poisson, self.density)

    @classmethod
    def isotropic(cls, material: Material) -> Lamina:
        """The lamina of an isotropic material; a material with its own G shears with that G."""
        E, G = material.E, material.G
        return cls(E1=E, E2=E, G12=G, nu12=material.nu, density=material.density)

    @classmethod
    def core(cls, density: float, G13: float, G23: float | None = None) -> Lamina:
        """A core (honeycomb, foam) that carries transverse shear only."""
        shears = {"G13": G13, "G23": G13 if G23 is None else G23}
        return cls(E1=0.0, E2=0.0, G12=0.0, nu12=0.0, density=density, **shears)

    def plane_stress(self, angle: float) -> Array:
        """Modulusness (3, 3) [N/m^2] between (xx, yy, xy) stresses and strains, axis 1 at angle [rad] from x."""
        Q = np.zeros((3, 3))
        if self.E1 > 0:
            nu21 = self.nu12 * self.E2 / self.E1
            off = self.nu12 * self.E2
            Q[:2, :2] = np.array([[self.E1, off], [off, self.E2]]) / (1 - self.nu12 * nu21)
        Q[2, 2] = self.G12
        R = strain_rotation(angle)
        return R.T @ Q @ R

    def transverse_shear(self, angle: float) -> Array:
        """Modulusness (2, 2) [N/m^2] between (xz, yz) stresses and strains, axis 1 at angle [rad] from x."""
        C = _rotation(angle)
        return C.T @ np.diag([self.G13, self.G23]) @ C


@dataclass(frozen=True)
class Ply:
    """A layer of a lamina: thickness [m], axis 1 at angle [rad] from the section's x axis."""

    lamina: Lamina
    thickness: float
    angle: float = 0.0

    def __post_init__(self) -> None:
        _require("thickness", self.thickness, "ply", positive=True)
        if not np.isfinite(self.angle):
            raise ValueError(f"angle of a ply is {self.angle} rad; it must be a finite number")


@dataclass(frozen=True, eq=False)
class PlateSection:
    """Modulusness and inertia of a plate per unit width and area, axes x, y in the plate.

    thickness  ()      total, as drawn [m]
    mass       ()      per unit area [kg/m^2], including non-structural mass
    rotary     ()      int rho z^2 dz about the middle plane [kg]
    A          (3, 3)  membrane forces from strains (xx, yy, xy) [N/m]
    D          (3, 3)  moments from curvatures (xx, yy, xy) [N m]
    S          (2, 2)  shear forces from mean shear strains (xz, yz) [N/m]
    B          (3, 3)  moments from membrane strains, forces from curvatures [N]; zero where nothing couples
    centre     ()      height of the mass centre above the surface of the nodes [m]; rotary is about it
    added      ()      the non-structural part of mass [kg/m^2]
    plies      (k, 2, 3, 6)  stress (11, 22, 12) in each ply's axes at its bottom and top, from the lowest ply on, per
                       membrane strain [N/m^2] and curvature [N/m] of the surface of the nodes; empty if unknown
    """

    thickness: float
    mass: float
    rotary: float
    A: Array
    D: Array
    S: Array
    B: Array = field(default_factory=lambda: np.zeros((3, 3)))
    centre: float = 0.0
    added: float = 0.0
    plies: Array = field(default_factory=lambda: np.zeros((0, 2, 3, 6)))

    def __post_init__(self) -> None:
        _require("thickness", self.thickness, "plate section", positive=True)
        _require("mass per area", self.mass, "plate section", positive=False)
        _require("rotary inertia per area", self.rotary, "plate section", positive=False)
        for name, size in (("A", 3), ("D", 3), ("S", 2), ("B", 3)):
            matrix = np.asarray(getattr(self, name), float)
            object.__setattr__(self, name, matrix)
            if matrix.shape != (size, size) or not np.isfinite(matrix).all():
                raise ValueError(
                    f"{name} of a plate section must be {size} x {size} finite numbers; found {matrix.tolist()}"
                )
            if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=1e-12 * np.abs(matrix).max()):
                raise ValueError(f"{name} of a plate section is not symmetric: {matrix.tolist()}")
            if name != "B":
                _require_positive_definite(name, matrix)
        if not np.isfinite(self.centre):
            raise ValueError(f"centre of a plate section is {self.centre} m; it must be finite")
        if self.coupled:
            _require_positive_definite("[A B; B D]", np.block([[self.A, self.B], [self.B, self.D]]))

    @property
    def coupled(self) -> bool:
        """Whether membrane and bending couple, or the mass lies off the surface of the nodes."""
        return bool(np.any(self.B)) or self.centre != 0.0

    def stiffness(self, angles: Array) -> tuple[Array, Array, Array]:
        """A, D (k, 3, 3) and S (k, 2, 2) in axes from which the section's x axis is turned by angles (k,) [rad]."""
        R, C = strain_rotation(angles), _rotation(angles)
        A, D = (np.matmul(R.swapaxes(1, 2), matrix @ R) for matrix in (self.A, self.D))
        return A, D, np.matmul(C.swapaxes(1, 2), self.S @ C)

    def ply_stiffness(self, angles: Array) -> Array:
        """`plies` (a, k, 2, 3, 6) per strains in axes from which the section's x axis is turned by angles (a,)
        [rad]."""
        R = strain_rotation(angles)[:, None, None]
        return np.concatenate([self.plies[..., :3] @ R, self.plies[..., 3:] @ R], axis=-1)

    def rotated(self, angle: float) -> PlateSection:
        """Return the section with its x axis rotated by angle [rad] towards y in the plate."""
        A, D, S = self.stiffness(np.array([angle]))
        R = strain_rotation(angle)
        return replace(self, A=A[0], D=D[0], S=S[0], B=R.T @ self.B @ R, plies=self.ply_stiffness(np.array([angle]))[0])

    def turned_over(self) -> PlateSection:
        """Return the section seen from below: rotated by half a turn about its x axis, so that angles count the other
        way."""
        M, C = np.diag([1.0, 1.0, -1.0]), np.diag([1.0, -1.0])
        A, D, S, B = M @ self.A @ M, M @ self.D @ M, C @ self.S @ C, -M @ self.B @ M
        plies = M @ self.plies[::-1, ::-1]
        plies = np.concatenate([plies[..., :3] @ M, -plies[..., 3:] @ M], axis=-1)
        return replace(self, A=A, D=D, S=S, B=B, centre=-self.centre, plies=plies)

    def with_added_mass(self, mass: float) -> PlateSection:
        """Return the section with additional non-structural mass per unit area [kg/m^2] at the height of its mass
        centre."""
        _require("non-structural mass per area", mass, "plate section", positive=False)
        return replace(self, mass=self.mass + mass, added=self.added + mass)

    def shifted(self, offset: float) -> PlateSection:
        """Return the section moved by offset [m] along the normal, off the surface of the nodes; its strains are those
        of this surface plus offset times the curvatures."""
        B, D = self.B + offset * self.A, self.D + 2 * offset * self.B + offset**2 * self.A
        return replace(self, B=B, D=D, centre=self.centre + offset, plies=scaled_plies(self.plies, 1.0, offset))


def layup(plies: Iterable[Ply], coupled: bool = False, extra_mass: float = 0.0) -> PlateSection:
    """Return the section of a stack of plies, from the bottom (-z) to the top; symmetric about its middle plane, or
    coupled.

    extra_mass: non-structural mass per area, such as that of cells and harness [kg/m^2].

    A = sum Q t, D = sum Q (z_top^3 - z_bottom^3) / 3 (classical lamination theory). Shear: the energy of the shear
    stresses that equilibrium gives to bending, S^-1 = int f^T G^-1 f dz with f from F(z) = int Q z dz D^-1 (Rolfes &
    Rohwer, Composites Sci. Tech. 58, 1998); 5/6 G h for a plain sheet, G d^2 / c for a sandwich of thin faces. It
    assumes cylindrical bending along x and along y, and so depends a little on the axes for angled plies.
    """
    stack = list(plies)
    if not stack:
        raise ValueError("a lay-up has no plies; give at least one")
    z = np.concatenate([[0.0], np.cumsum([ply.thickness for ply in stack])])
    z = z - z[-1] / 2
    Q = np.array([ply.lamina.plane_stress(ply.angle) for ply in stack])
    rho = np.array([ply.lamina.density for ply in stack])
    moments = [np.diff(z**power) / power for power in (1, 2, 3)]
    A, B, D = (np.einsum("p,pij->ij", moment, Q) for moment in moments)
    eccentricity = float(rho @ moments[1]) / max(float(rho @ moments[0]) * (z[-1] - z[0]), np.finfo(float).tiny)
    symmetric = not (
        np.abs(B).max() > COUPLING_TOLERANCE * np.sqrt(np.abs(A).max() * np.abs(D).max())
        or abs(eccentricity) > COUPLING_TOLERANCE
    )
    if not symmetric and not coupled:
        raise ValueError(
            f"the lay-up of {len(stack)} plies is not symmetric about its middle plane: its membrane-bending coupling "
            f"B is up to {np.abs(B).max():.3g} N and its mass centre lies {eccentricity * (z[-1] - z[0]):.3g} m off; "
            "plates take symmetric lay-ups, so mirror the plies, or use the family shell (in Python: layup(..., "
            "coupled=True))"
        )
    _require_positive_definite("D", D)
    B, centre = (np.zeros((3, 3)), 0.0) if symmetric else (B, eccentricity * float(z[-1] - z[0]))
    S = _shear_stiffness(stack, z, Q, A, B, D)
    mass = float(rho @ moments[0])
    rotary = float(rho @ moments[2]) - mass * centre**2
    # stress in the ply's axes
    stiffness_of_plies = [ply.lamina.plane_stress(0.0) @ strain_rotation(ply.angle) for ply in stack]
    ends = zip(stiffness_of_plies, z[:-1], z[1:], strict=True)
    plies = np.array([[np.hstack([C, height * C]) for height in (low, high)] for C, low, high in ends])
    section = PlateSection(float(z[-1] - z[0]), mass, rotary, A, D, S, B, centre, plies=plies)
    return section.with_added_mass(extra_mass)


def isotropic(thickness: float, material: Material, extra_mass: float = 0.0) -> PlateSection:
    """Section of a plain sheet, thickness [m]: D = E h^3 / 12(1 - nu^2), S = 5/6 G h."""
    return layup([Ply(Lamina.isotropic(material), thickness)], extra_mass=extra_mass)


def orthotropic(
    thickness: float, E1: float, E2: float, G12: float, nu12: float, density: float, angle: float = 0.0,
    G13: float | None = None, G23: float | None = None, extra_mass: float = 0.0,
) -> PlateSection:  # fmt: skip
    """Section of a sheet of one orthotropic material, axis 1 at angle [rad] from the section's x axis."""
    shear = {"G13": G12 if G13 is None else G13, "G23": G12 if G23 is None else G23}
    lamina = Lamina(E1=E1, E2=E2, G12=G12, nu12=nu12, density=density, **shear)
    return layup([Ply(lamina, thickness, angle)], extra_mass=extra_mass)


def sandwich(face: Ply, core_thickness: float, core: Lamina, extra_mass: float = 0.0) -> PlateSection:
    """Section of two equal faces on a core [m]: bending from the faces (and the core's own E), shear from the core."""
    return layup([face, Ply(core, core_thickness), face], extra_mass=extra_mass)


def scaled_plies(plies: Array, factor: Array | float, offset: float) -> Array:
    """`PlateSection.plies` of all thicknesses times a factor (...) [1], then moved by offset [m]: (..., k, 2, 3, 6)."""
    f = np.asarray(factor, float)[..., None, None, None, None]
    membrane = np.broadcast_to(plies[..., :3], (*np.shape(factor), *plies.shape[:3], 3))
    return np.concatenate([membrane, f * plies[..., 3:] + offset * membrane], axis=-1)


def strain_rotation(angle: Array | float) -> Array:
    """R (..., 3, 3): engineering strains (11, 22, 12) in axes turned by angle (...) [rad], from (xx, yy, xy)."""
    c, s = np.cos(angle), np.sin(angle)
    rows = [[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _rotation(angle: Array | float) -> Array:
    """C (..., 2, 2): components along axes turned by angle (...) [rad], from (x, y)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.moveaxis(np.array([[c, s], [-s, c]]), (0, 1), (-2, -1))


def _shear_stiffness(stack: list[Ply], z: Array, Q: Array, A: Array, B: Array, D: Array) -> Array:
    """S (2, 2) of `layup`; bending moments alone strain by (b + z d) M, b = -A^-1 B d."""
    inverse = np.linalg.inv(D - B @ np.linalg.solve(A, B))
    flexibility = np.zeros((2, 2))
    stretch = -np.linalg.solve(A, B) @ inverse if B.any() else np.zeros((3, 3))
    below = np.zeros((3, 3))  # int Q (b + z d) dz from the bottom to this ply
    for ply, bottom, top, stiffness in zip(stack, z[:-1], z[1:], Q, strict=True):
        G = ply.lamina.transverse_shear(ply.angle)
        for position, weight in zip(*_GAUSS, strict=True):
            height = (bottom + top) / 2 + position * (top - bottom) / 2
            F = below + stiffness @ (stretch * (height - bottom) + inverse * (height**2 - bottom**2) / 2)
            f = np.array([[F[0, 0], F[2, 1]], [F[2, 0], F[1, 1]]])
            flexibility += weight * (top - bottom) / 2 * f.T @ np.linalg.solve(G, f)
        below = below + stiffness @ (stretch * (top - bottom) + inverse * (top**2 - bottom**2) / 2)
    return np.asarray(np.linalg.inv(flexibility))


def _require_positive_definite(name: str, matrix: Array) -> None:
    values = np.linalg.eigvalsh(matrix)
    if not values[0] > 0:
        raise ValueError(
            f"{name} of a plate section is not positive definite: its eigenvalues are {values.tolist()}; the strain "
            "energy must be positive in every strain (a soft core needs faces)"
        )


def _require(name: str, value: float, what: str, positive: bool) -> None:
    if not np.isfinite(value) or value < 0 or (positive and value == 0):
        rule = "it must be positive" if positive else "it cannot be negative"
        raise ValueError(f"{name} of a {what} is {value}; {rule} and finite")
