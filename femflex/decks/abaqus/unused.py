"""Keywords and elements that the structure ignores, and the consequences."""

from __future__ import annotations

import re

from femflex.decks.abaqus.materials import IGNORED_BEHAVIOUR
from femflex.decks.abaqus.model import AbaqusModel, location_of
from femflex.decks.abaqus.sections import PLANE_TYPES
from femflex.decks.findings import Location
from femflex.mesh.formats.abaqus_flat import Element

# keywords of the mesh, and of procedures, outputs and choices that do not concern the structure
WITHOUT_CONSEQUENCE = {
    "HEADING", "NODE", "SYSTEM", "NGEN", "NFILL", "ELEMENT", "ELGEN", "NSET", "ELSET", "PART", "END PART", "ASSEMBLY",
    "END ASSEMBLY", "INSTANCE", "END INSTANCE", "STEP",
    "END STEP", "PREPRINT", "RESTART", "OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "NODE FILE", "EL FILE", "NODE PRINT",
    "EL PRINT", "ENERGY OUTPUT", "ENERGY PRINT", "ENERGY FILE", "CONTACT OUTPUT", "CONTACT FILE", "CONTACT PRINT",
    "FILE FORMAT",
    "MONITOR", "FILE OUTPUT", "MODAL OUTPUT", "MODAL FILE", "MODAL PRINT", "INTEGRATED OUTPUT", "SECTION PRINT",
    "SECTION FILE", "PRINT", "CONTROLS", "SOLUTION TECHNIQUE", "TIME POINTS", "AMPLITUDE", "FREQUENCY", "STATIC",
    "DYNAMIC", "BUCKLE", "MODAL DYNAMIC", "STEADY STATE DYNAMICS", "VISCO", "COUPLED TEMPERATURE-DISPLACEMENT",
    "HEAT TRANSFER", "SECTION CONTROLS", "HOURGLASS STIFFNESS", "TRANSVERSE SHEAR STIFFNESS", "PHYSICAL CONSTANTS",
    "FILTER", "DIAGNOSTICS", "VISUALIZATION", "END", "USER OUTPUT VARIABLES", "COMPLEX FREQUENCY", "DISTRIBUTION TABLE",
}  # fmt: skip
CONSEQUENCES = {
    "loads of this kind are left out; give them in the case": (
        "DFLUX", "CFLUX", "FILM", "RADIATE", "TEMPERATURE", "BASE MOTION", "SFILM",
        "SRADIATE",
        "PRE-TENSION SECTION", "INERTIA RELIEF", "INITIAL CONDITIONS", "MASS FLOW",
    ),
    "contact is left out; the parts are not joined there": (
        "CONTACT PAIR", "CONTACT", "CONTACT INCLUSIONS", "SURFACE INTERACTION", "SURFACE BEHAVIOR", "FRICTION",
        "CONTACT PROPERTY ASSIGNMENT", "CLEARANCE", "GAP", "GAP CONDUCTANCE", "CONTACT DAMPING", "CHANGE CONTACT TYPE",
        "CONTACT INTERFERENCE",
    ),
    "connectors are left out; the parts may be unconnected": (
        "CONNECTOR SECTION", "CONNECTOR BEHAVIOR", "CONNECTOR ELASTICITY", "CONNECTOR DAMPING", "CONNECTOR MOTION",
        "FASTENER",
    ),
    "the parts that it joins are not connected": (
        "SHELL TO SOLID COUPLING", "EMBEDDED ELEMENT",
    ),
    "damping is left out; give it in the case": ("DASHPOT", "MODAL DAMPING", "GLOBAL DAMPING", "DAMPING"),
    "cyclic symmetry is left out; the stiffness and mass of the other sectors are missing": (
        "CYCLIC SYMMETRY MODEL", "SELECT CYCLIC SYMMETRY MODES",
    ),
    "matrices and user elements are left out; their stiffness and mass are missing": (
        "STIFFENER", "USER ELEMENT", "UEL PROPERTY", "MATRIX", "MATRIX INPUT", "MATRIX ASSEMBLE",
        "SUBSTRUCTURE PROPERTY",
    ),
    "fluids are left out; the mass of the fluid is missing": (
        "FLUID BEHAVIOR", "FLUID CAVITY", "FLUID PROPERTY", "FLUID DENSITY", "FLUID BULK MODULUS", "FLUID EXPANSION",
        "FLUID LINK", "FLUID EXCHANGE", "FLUID INFLATOR", "ACOUSTIC FLOW VELOCITY", "IMPEDANCE", "SIMPEDANCE",
        "INCIDENT WAVE", "AQUA",
    ),
    "rebars are left out": ("REBAR", "REBAR LAYER"),
    "elements stay in the model": ("MODEL CHANGE",),
    "a distribution of values is left out; the default is used": ("DISTRIBUTION",),
    "imperfections are left out; the mesh is perfect": ("IMPERFECTION",),
}  # fmt: skip


CONSEQUENCES_OF_TYPES = (  # by the beginning of the type of an element; the first match is used
    (r"CAX|CGAX|SAX|MAX|DCAX|ACAX",
     "axisymmetric elements are left out: a body has three dimensions; model the whole body of revolution"),
    (r"CPS|CPE",
     "plane elements are left out: they do not move out of their plane; model the sheet by shells (S4R with a "
     "*SHELL SECTION of its thickness)"),
    (r"AC|F3D|ASI|FLINK", "elements of fluids are left out: the mass of the fluid is missing"),
    (r"DC|DS", "elements of heat are left out: they have no stiffness; model the structure by C3D or S types"),
    (r"Z\d+$", "substructures are left out: their stiffness and mass are missing"),
    (r"COH", "cohesive elements are left out: the parts are not connected there; join them by *TIE"),
    (r"U|VU",
     "user elements are left out: their stiffness, in a subroutine, is missing; export it by *MATRIX GENERATE"),
    (r"CONN", "connectors are left out: the parts may be unconnected; join them by *COUPLING, *MPC or *SPRING"),
    (r"", "elements of this type are left out; the parts that they join may be unconnected"),
)  # fmt: skip


def report_unused(model: AbaqusModel) -> None:
    """Report the keywords and elements that the structure ignores."""
    consequence_of = {name: text for text, names in CONSEQUENCES.items() for name in names}
    read = {*model.findings.used, *(entry.card for entry in model.findings.left_out)}
    behaviour = False
    for _, keyword in model.flat.keywords:
        name = keyword.name
        behaviour = name == "MATERIAL" or (behaviour and not name.endswith("SECTION") and name != "STEP")
        # those of materials are reported with the materials
        if f"*{name}" in read or name in WITHOUT_CONSEQUENCE or (behaviour and name in IGNORED_BEHAVIOUR):
            continue
        model.findings.unused(
            f"*{name}", consequence_of.get(name, "it is not understood and left out"), location_of(keyword)
        )
    read_types = ("MASS", "ROTARYI", "SPRINGA", "SPRING1", "SPRING2", "JOINTC", "DCOUP3D", "DISTRIBUTING")
    unused_elements = [
        element
        for element in model.flat.elements.values()
        if element.kind not in read_types and (not element.cell or element.kind.startswith(PLANE_TYPES))
    ]
    for kind, (count, location) in elements_by_kind(unused_elements).items():
        model.findings.unused(f"elements {kind}", consequence_of_type(kind), location, count)


def elements_by_kind(elements: list[Element]) -> dict[str, tuple[int, Location]]:
    """Number of elements of each type, and the location of the first one."""
    kinds: dict[str, tuple[int, Location]] = {}
    for element in elements:
        file, _, line = element.location.rpartition(", line ")
        count, first = kinds.get(element.kind, (0, Location(file, int(line))))
        kinds[element.kind] = count + 1, first
    return kinds


def consequence_of_type(kind: str) -> str:
    """Consequence of ignoring elements of this type, and what to use instead."""
    return next(text for pattern, text in CONSEQUENCES_OF_TYPES if re.match(pattern, kind))
