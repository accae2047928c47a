"""Sections of beams: *BEAM SECTION with its shapes, *BEAM GENERAL SECTION with its numbers.

Heights (the 2-axis of Abaqus) lie along the section's y axis in femflex, widths (the 1-axis) along z in either sense.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from femflex.decks.abaqus.model import AbaqusModel
from femflex.decks.materials import Elastic
from femflex.decks.model import MASSLESS
from femflex.fem.sections import profiles
from femflex.fem.sections.library import StiffnessSection
from femflex.fem.sections.profiles import Place, SectionProperties, principal_moments
from femflex.mesh.formats.abaqus_keywords import Keyword

SHAPES = {  # number of dimensions, and Abaqus' own shear factor
    "RECT": (2, 0.85), "CIRC": (1, 0.89), "PIPE": (2, 0.53), "THICK PIPE": (2, 0.53), "BOX": (6, 0.44), "I": (7, 0.44),
    "T": (5, 0.44), "L": (4, 1.0),
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
    centroid: Place = (0.0, 0.0)


def beam_section(model: AbaqusModel, material: Elastic, keyword: Keyword) -> BeamSection:
    """The BeamSection of *BEAM SECTION."""
    E, G, rho = material.bar()
    kind = _kind(keyword.parameter("section"))
    section, centroid = _shape(model, keyword, kind)
    return _principal_section(section, E, G, rho, SHAPES[kind][1], _n1(keyword, 1), centroid)


def general_section(model: AbaqusModel, keyword: Keyword) -> BeamSection:
    """The BeamSection of *BEAM GENERAL SECTION: a shape or A, I11, I12, I22, J; then n1; then E, G."""
    u = model.units
    kind = _kind(keyword.parameter("section") or "GENERAL")
    rho = float(keyword.parameter("density") or 0.0) * u.density
    moduli = _row(keyword, 2)
    if len(moduli) < 2:
        raise keyword.error(f"has {len(moduli)} moduli on its third line; give E, G.")
    E, G = (value * u.pressure for value in moduli[:2])
    if kind == "GENERAL":
        values, centroid = _row(keyword, 0), (0.0, 0.0)
        if len(values) < 5:
            raise keyword.error(f": SECTION=GENERAL has {len(values)} values; give A, I11, I12, I22 and J.")
        I11, I12, I22, J = (value * u.length**4 for value in values[1:5])
        # y lies along the 2-axis: I11 = int (along 2)^2 dA bends about 1
        section = profiles.by_numbers(values[0] * u.length**2, I11, I22, J, -I12)
    else:
        section, centroid = _shape(model, keyword, kind)
    return _principal_section(section, E, G, rho, SHAPES.get(kind, (0, 1.0))[1], _n1(keyword, 1), centroid)


def with_shear(model: AbaqusModel, beam: BeamSection, keyword: Keyword) -> BeamSection:
    """The section with K23, K13 of *TRANSVERSE SHEAR STIFFNESS, along 2 and along 1; if one is 0 it equals the other.

    Raises ValueError if both are missing, one is negative, or they differ and the principal axes are rotated.
    """
    values = [value * model.units.force for value in _row(keyword, 0)[:2]]
    k23, k13 = [*values, 0.0, 0.0][:2]
    if min(k23, k13) < 0 or not max(k23, k13) > 0:
        raise keyword.error(f"has K23, K13 = {values} N; give positive ones.")
    k23, k13 = k23 or k13, k13 or k23
    if beam.principal and abs(k23 - k13) > 1e-9 * k23:
        raise keyword.error(
            f": the section's principal axes are turned by {math.degrees(beam.principal):.4g} deg, and K23 = "
            f"{k23:.6g} N differs from K13 = {k13:.6g} N; give I12 = 0, with n1 along a principal axis."
        )
    section = beam.section.model_copy(update={"GAy": k23, "GAz": k13})
    return replace(beam, section=section, shears=True)


def _principal_section(
    section: SectionProperties,
    E: float,
    G: float,
    rho: float,
    factor: float,
    n1: tuple[float, ...] | None,
    centroid: Place,
) -> BeamSection:  # fmt: skip
    """The section in principal axes; centroid: from the nodes."""
    A, I1, I2 = section.A, section.Iz, section.Iy
    if not (A > 0 and I1 > 0 and I2 > 0 and E > 0):
        raise ValueError(
            f"a beam section has A = {A:.6g} m^2, I = {I1:.6g}, {I2:.6g} m^4 and E = {E:.6g} Pa; all must be positive"
        )
    alpha, I1, I2 = principal_moments(I1, I2, section.Iyz)
    c, s = math.cos(alpha), math.sin(alpha)
    y, z = centroid if math.hypot(*centroid) > 1e-9 * math.sqrt(A) else (0.0, 0.0)
    J = section.J if section.J > 0 else 1e-9 * (I1 + I2)
    GA = max(factor * G * A, 1e-9 * E * A)
    stiffness = StiffnessSection(
        EA=E * A, EIy=E * I2, EIz=E * I1, GJ=(G if G > 0 else 1e-9 * E) * J,
        mass_per_length=max(rho * A, MASSLESS * E * A), ry=math.sqrt(I2 / A) if rho > 0 else 1e-9,
        rz=math.sqrt(I1 / A) if rho > 0 else 1e-9, GAy=GA, GAz=GA,
    )  # fmt: skip
    return BeamSection(stiffness, n1, G > 0, alpha, (c * y + s * z, c * z - s * y))


def _kind(word: str) -> str:
    """The name of a shape, which may be written in full."""
    kind = " ".join(word.upper().replace("_", " ").split())
    return next((name for name in ("RECT", "CIRC") if kind.startswith(name)), kind)


def _shape(model: AbaqusModel, keyword: Keyword, kind: str) -> tuple[SectionProperties, Place]:
    """The profile [m], and its centroid (y, z) from the nodes."""
    d = [value * model.units.length for value in _row(keyword, 0)]
    if kind not in SHAPES:
        raise keyword.error(
            f": SECTION={kind or '(none)'} is not read; known are {', '.join(SHAPES)} and, in *BEAM GENERAL SECTION, "
            "GENERAL with A, I11, I12, I22 and J."
        )
    if kind == "RECT" and len(d) == 1:
        d = d * 2
    if len(d) < SHAPES[kind][0] or any(value < 0 for value in d):
        raise keyword.error(f": SECTION={kind} has dimensions {d} m; give {SHAPES[kind][0]}, none negative.")
    if kind == "RECT":
        return profiles.bar(*d[:2]), (0.0, 0.0)
    if kind == "CIRC":
        a, b = d[0], d[1] if len(d) > 1 and d[1] > 0 else d[0]  # CalculiX: half axes along 1 and 2
        return profiles.ellipse(b, a), (0.0, 0.0)
    if kind in ("PIPE", "THICK PIPE"):
        return profiles.tube(*d[:2]), (0.0, 0.0)
    if kind == "BOX":  # widths along 1 and 2, then the walls at +1, +2, -1, -2; the nodes are at its middle
        a, b, right, top, left, bottom = d[:6]
        box = profiles.box(a, b, top, bottom, right, left)  # z is against 1
        walls = (a * (top**3 + bottom**3) + b * (left**3 + right**3)) / 3  # torsion constant of the open section
        return replace(box, J=box.J + walls), box.centroid
    if kind == "I":
        low, h, b1, b2, t1, t2, web = d[:7]
        section = profiles.i_section(h, b1, b2, web, t1, t2)
        return section, (section.centroid[0] + h / 2 - low, 0.0)
    if kind == "T":
        b, h, low, tf, tw = d[:5]
        section = profiles.tee(b, h, tf, tw)
        return section, (section.centroid[0] + h - tf / 2 - low, 0.0)
    a, b, t1, t2 = d[:4]  # L: legs along 1 (thickness t1) and 2 (t2), the nodes where their middles cross
    section = profiles.angle(a, b, t1, t2)  # z is against 1
    J, (y, z) = (a * t1**3 + (b - t1) * t2**3) / 3, section.centroid
    return replace(section, Iyz=-section.Iyz, J=J), (y, -(z + a / 2))


def _row(keyword: Keyword, k: int) -> list[float]:
    if k >= len(keyword.data):
        return []
    return [keyword.real(word, k, "a number") for word in keyword.data[k] if word]


def _n1(keyword: Keyword, k: int) -> tuple[float, ...] | None:
    if k >= len(keyword.data) or not any(keyword.data[k]):
        return None
    values = [keyword.real(word, k, "a direction") for word in keyword.data[k]]
    return tuple([*values, 0.0, 0.0][:3]) if any(values) else None
