"""Sections of beams: *BEAM SECTION with its shapes, *BEAM GENERAL SECTION with its numbers.

Heights (the 2-axis of Abaqus) lie along the section's y axis in femflex, widths (the 1-axis) along z in either sense.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from femflex.decks.abaqus.materials import Elastic
from femflex.decks.abaqus.model import AbaqusModel
from femflex.decks.nastran.bar_shapes import Shape, shape_of
from femflex.fem.sections.library import StiffnessSection
from femflex.mesh.abaqus_keywords import Keyword

MASSLESS = 1e-18  # [s^2/m^2] mass per length over EA given to beams without mass
SHEAR_FACTORS = {  # Abaqus' own, by shape
    "RECT": 0.85, "CIRC": 0.89, "PIPE": 0.53, "THICK PIPE": 0.53, "BOX": 0.44, "I": 0.44, "T": 0.44, "L": 1.0,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class BeamSection:
    """A section with its direction n1 in the deck, principal axes, centroid, and whether it has transverse shear.

    principal  [rad] about the tangent
    centroid   y and z from the nodes [m], along the principal axes
    """

    section: StiffnessSection
    n1: tuple[float, ...] | None
    shears: bool
    principal: float = 0.0
    centroid: tuple[float, float] = (0.0, 0.0)


def beam_section(model: AbaqusModel, material: Elastic, keyword: Keyword, elset: str) -> BeamSection:
    """The BeamSection of *BEAM SECTION."""
    E, G, rho = material.bar()
    kind = _kind(keyword.parameter("section"))
    values = _row(keyword, 0)
    shape, centroid = _shape(keyword, kind, [value * model.units.length for value in values])
    return _principal_section(shape, E, G, rho, SHEAR_FACTORS[kind], _n1(keyword, 1), centroid)


def general_section(model: AbaqusModel, keyword: Keyword, elset: str) -> BeamSection:
    """The BeamSection of *BEAM GENERAL SECTION: a shape or A, I11, I12, I22, J; then n1; then E, G."""
    u = model.units
    kind = _kind(keyword.parameter("section") or "GENERAL")
    rho = float(keyword.parameter("density") or 0.0) * u.density
    values = _row(keyword, 0)
    moduli = _row(keyword, 2)
    if len(moduli) < 2:
        raise ValueError(
            f"{keyword.location()}: *BEAM GENERAL SECTION has {len(moduli)} moduli on its third line; give E, G."
        )
    E, G = (value * u.pressure for value in moduli[:2])
    centroid = (0.0, 0.0)
    if kind == "GENERAL":
        if len(values) < 5:
            raise ValueError(
                f"{keyword.location()}: SECTION=GENERAL has {len(values)} values; give A, I11, I12, I22 and J."
            )
        A = values[0] * u.length**2
        I11, I12, I22, J = (value * u.length**4 for value in values[1:5])
        # y lies along the 2-axis: I11 = int (along 2)^2 dA bends about 1
        shape = Shape(A, I11, I22, J, -I12)
    else:
        shape, centroid = _shape(keyword, kind, [value * u.length for value in values])
    return _principal_section(shape, E, G, rho, SHEAR_FACTORS.get(kind, 1.0), _n1(keyword, 1), centroid)


def with_shear(model: AbaqusModel, beam: BeamSection, keyword: Keyword) -> BeamSection:
    """The section with K23, K13 of *TRANSVERSE SHEAR STIFFNESS, along 2 and along 1; if one is 0 it equals the other.

    Raises ValueError if both are missing, one is negative, or they differ and the principal axes are rotated.
    """
    values = [value * model.units.force for value in _row(keyword, 0)[:2]]
    k23, k13 = [*values, 0.0, 0.0][:2]
    if min(k23, k13) < 0 or not max(k23, k13) > 0:
        raise ValueError(
            f"{keyword.location()}: *TRANSVERSE SHEAR STIFFNESS has K23, K13 = {values} N; give positive ones."
        )
    k23, k13 = k23 or k13, k13 or k23
    if beam.principal and abs(k23 - k13) > 1e-9 * k23:
        raise ValueError(
            f"{keyword.location()}: the section's principal axes are turned by {math.degrees(beam.principal):.4g} deg, "
            f"and K23 = {k23:.6g} N differs from K13 = {k13:.6g} N; give I12 = 0, with n1 along a principal axis."
        )
    return replace(beam, section=replace(beam.section, GAy=k23, GAz=k13), shears=True)


def _principal_section(
    shape: Shape,
    E: float,
    G: float,
    rho: float,
    factor: float,
    n1: tuple[float, ...] | None,
    centroid_from_nodes: tuple[float, float],
) -> BeamSection:
    """The section in principal axes; shape.I1 = int y^2 dA, shape.I2 = int z^2 dA."""
    if not (shape.A > 0 and shape.I1 > 0 and shape.I2 > 0 and E > 0):
        raise ValueError(f"a beam section has A = {shape.A:.6g} m^2, I = {shape.I1:.6g}, {shape.I2:.6g} m^4 and "
                         f"E = {E:.6g} Pa; all must be positive")  # fmt: skip
    I1, I2, I12 = shape.I1, shape.I2, shape.I12
    alpha = 0.0
    if abs(I12) > 1e-9 * max(I1, I2):
        alpha = 0.5 * math.atan2(2 * I12, I1 - I2)
        mean, radius = (I1 + I2) / 2, math.hypot((I1 - I2) / 2, I12)
        I1, I2 = mean + radius, mean - radius
    c, s = math.cos(alpha), math.sin(alpha)
    tolerance = 1e-9 * math.sqrt(shape.A)
    centroid = (
        (
            c * centroid_from_nodes[0] + s * centroid_from_nodes[1],
            c * centroid_from_nodes[1] - s * centroid_from_nodes[0],
        )
        if math.hypot(*centroid_from_nodes) > tolerance
        else (0.0, 0.0)
    )
    mass = max(rho * shape.A, MASSLESS * E * shape.A)
    has_mass = rho > 0
    J = shape.J if shape.J > 0 else 1e-9 * (I1 + I2)
    section = StiffnessSection(
        EA=E * shape.A, EIy=E * I2, EIz=E * I1, GJ=(G if G > 0 else 1e-9 * E) * J, mass_per_length=mass,
        ry=math.sqrt(I2 / shape.A) if has_mass else 1e-9, rz=math.sqrt(I1 / shape.A) if has_mass else 1e-9,
        GAy=max(factor * G * shape.A, 1e-9 * E * shape.A), GAz=max(factor * G * shape.A, 1e-9 * E * shape.A),
    )  # fmt: skip
    return BeamSection(section, n1, G > 0, alpha, centroid)


def _kind(word: str) -> str:
    """The name of a shape, which may be written in full."""
    kind = " ".join(word.upper().replace("_", " ").split())
    return next((name for name in ("RECT", "CIRC") if kind.startswith(name)), kind)


def _shape(keyword: Keyword, kind: str, d: list[float]) -> tuple[Shape, tuple[float, float]]:
    """The shape [m], and the centroid (y, z) from the nodes."""
    counts = {"RECT": 2, "CIRC": 1, "PIPE": 2, "THICK PIPE": 2, "BOX": 6, "I": 7, "T": 5, "L": 4}
    if kind not in counts:
        raise ValueError(
            f"{keyword.location()}: SECTION={kind or '(none)'} is not read; known are {', '.join(counts)} and, in "
            "*BEAM GENERAL SECTION, GENERAL with A, I11, I12, I22 and J."
        )
    if kind == "RECT" and len(d) == 1:
        d = d * 2
    if len(d) < counts[kind] or any(value < 0 for value in d):
        raise ValueError(
            f"{keyword.location()}: SECTION={kind} has dimensions {d} m; give {counts[kind]}, none negative."
        )
    if kind == "RECT":
        return shape_of("BAR", [d[0], d[1]]), (0.0, 0.0)
    if kind == "CIRC":
        a, b = d[0], d[1] if len(d) > 1 and d[1] > 0 else d[0]  # CalculiX: half axes along 1 and 2
        A, J = math.pi * a * b, math.pi * (a * b) ** 3 / (a**2 + b**2)
        return Shape(A, math.pi * a * b**3 / 4, math.pi * b * a**3 / 4, J), (0.0, 0.0)
    if kind in ("PIPE", "THICK PIPE"):
        return shape_of("TUBE", [d[0], d[0] - d[1]]), (0.0, 0.0)
    if kind == "BOX":  # widths along 1 and 2, then the walls at +1, +2, -1, -2
        a, b, right, top, left, bottom = d[:6]
        box = shape_of("BOX1", [a, b, top, bottom, right, left])  # z is against 1
        walls = (a * (top**3 + bottom**3) + b * (left**3 + right**3)) / 3  # torsion constant of the open section
        hole = (a - left - right) * (b - top - bottom) / box.A  # the nodes are at the middle of the box
        return replace(box, J=box.J + walls), (hole * (top - bottom) / 2, -hole * (right - left) / 2)
    if kind == "I":
        low, h, b1, b2, t1, t2, web = d[:7]
        parts = [(t1 / 2, b1 * t1), (h - t2 / 2, b2 * t2), ((h + t1 - t2) / 2, web * (h - t1 - t2))]
        centroid = sum(y * A for y, A in parts) / sum(A for _, A in parts)
        return shape_of("I", [h, b1, b2, web, t1, t2]), (centroid - low, 0.0)
    if kind == "T":
        b, h, low, tf, tw = d[:5]
        parts = [((h - tf) / 2, tw * (h - tf)), (h - tf / 2, b * tf)]
        centroid = sum(y * A for y, A in parts) / sum(A for _, A in parts)
        return shape_of("T", [b, h, tf, tw]), (centroid - low, 0.0)
    a, b, t1, t2 = d[:4]  # L: legs along 1 (thickness t1) and 2 (t2), the nodes where their middles cross
    rects = [(t1 / 2, a / 2, t1, a), ((b + t1) / 2, t2 / 2, b - t1, t2)]  # along 2, along 1, height, width
    A = sum(h * w for _, _, h, w in rects)
    y0, z0 = (sum(r[k] * r[2] * r[3] for r in rects) / A for k in (0, 1))
    I1 = sum(w * h**3 / 12 + h * w * (y - y0) ** 2 for y, _, h, w in rects)
    I2 = sum(h * w**3 / 12 + h * w * (z - z0) ** 2 for _, z, h, w in rects)
    I12 = -sum(h * w * (y - y0) * (z - z0) for y, z, h, w in rects)  # z here is against 1
    J = (a * t1**3 + (b - t1) * t2**3) / 3
    return Shape(A, I1, I2, J, I12), (y0 - t1 / 2, -(z0 - t2 / 2))


def _row(keyword: Keyword, k: int) -> list[float]:
    if k >= len(keyword.data):
        return []
    return [keyword.real(word, k, "a number") for word in keyword.data[k] if word]


def _n1(keyword: Keyword, k: int) -> tuple[float, ...] | None:
    if k >= len(keyword.data) or not any(keyword.data[k]):
        return None
    values = [keyword.real(word, k, "a direction") for word in keyword.data[k]]
    return tuple([*values, 0.0, 0.0][:3]) if any(values) else None
