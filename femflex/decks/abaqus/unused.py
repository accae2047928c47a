"""Keywords that a structure is made without, and what that changes."""

from __future__ import annotations

from femflex.decks.abaqus.model import AbaqusModel, place_of
from femflex.decks.abaqus.sections import PLANE

READ = {  # keywords that are read, or that say nothing of the structure
    "HEADING", "NODE", "SYSTEM", "NGEN", "NFILL", "ELEMENT", "ELGEN", "NSET", "ELSET", "PART", "END PART", "ASSEMBLY",
    "END ASSEMBLY", "INSTANCE", "END INSTANCE", "SURFACE", "MATERIAL", "ELASTIC", "DENSITY", "ORIENTATION", "TRANSFORM",
    "SHELL SECTION", "SHELL GENERAL SECTION", "MEMBRANE SECTION", "SOLID SECTION", "BEAM SECTION", "NODAL THICKNESS",
    "BEAM GENERAL SECTION", "MASS", "ROTARY INERTIA", "SPRING", "RIGID BODY", "COUPLING", "KINEMATIC", "DISTRIBUTING",
    "KINEMATIC COUPLING", "DISTRIBUTING COUPLING", "MPC", "EQUATION", "TIE", "BOUNDARY", "STEP", "END STEP",
    "PREPRINT", "RESTART", "OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "NODE FILE", "EL FILE", "NODE PRINT", "EL PRINT",
    "ENERGY OUTPUT", "ENERGY PRINT", "ENERGY FILE", "CONTACT OUTPUT", "CONTACT FILE", "CONTACT PRINT", "FILE FORMAT",
    "MONITOR", "FILE OUTPUT", "MODAL OUTPUT", "MODAL FILE", "MODAL PRINT", "INTEGRATED OUTPUT", "SECTION PRINT",
    "SECTION FILE", "PRINT", "CONTROLS", "SOLUTION TECHNIQUE", "TIME POINTS", "AMPLITUDE", "FREQUENCY", "STATIC",
    "DYNAMIC", "BUCKLE", "MODAL DYNAMIC", "STEADY STATE DYNAMICS", "VISCO", "COUPLED TEMPERATURE-DISPLACEMENT",
    "HEAT TRANSFER", "SECTION CONTROLS", "HOURGLASS STIFFNESS", "TRANSVERSE SHEAR STIFFNESS", "PHYSICAL CONSTANTS",
    "FILTER", "DIAGNOSTICS", "VISUALIZATION", "END", "USER OUTPUT VARIABLES", "COMPLEX FREQUENCY", "DISTRIBUTION TABLE",
}  # fmt: skip
CONSEQUENCES = {
    "loads are left out; give them in the case": (
        "CLOAD", "DLOAD", "DSLOAD", "DFLUX", "CFLUX", "FILM", "RADIATE", "TEMPERATURE", "BASE MOTION", "SFILM",
        "SRADIATE",
        "PRE-TENSION SECTION", "INERTIA RELIEF", "INITIAL CONDITIONS", "MASS FLOW",
    ),
    "contact is left out; the parts are not joined there": (
        "CONTACT PAIR", "CONTACT", "CONTACT INCLUSIONS", "SURFACE INTERACTION", "SURFACE BEHAVIOR", "FRICTION",
        "CONTACT PROPERTY ASSIGNMENT", "CLEARANCE", "GAP", "GAP CONDUCTANCE", "CONTACT DAMPING", "CHANGE CONTACT TYPE",
        "CONTACT INTERFERENCE",
    ),
    "connectors are left out; the parts may be loose": (
        "CONNECTOR SECTION", "CONNECTOR BEHAVIOR", "CONNECTOR ELASTICITY", "CONNECTOR DAMPING", "CONNECTOR MOTION",
        "JOINT", "FASTENER",
    ),
    "parts that it joins are loose": ("SHELL TO SOLID COUPLING", "EMBEDDED ELEMENT", "SUBSTRUCTURE PROPERTY"),
    "damping is left out; give it in the case": ("DASHPOT", "MODAL DAMPING", "GLOBAL DAMPING", "DAMPING"),
    "the structure is taken as the deck gives it, not as a sector of one": (
        "CYCLIC SYMMETRY MODEL", "SELECT CYCLIC SYMMETRY MODES",
    ),
    "the elements have the stiffness of their sections": ("STIFFENER", "USER ELEMENT", "MATRIX"),
    "mass that is not structure is left out; that mass is missing": ("NONSTRUCTURAL MASS",),
    "rebars are left out": ("REBAR", "REBAR LAYER"),
    "elements stay in the model": ("MODEL CHANGE",),
    "a distribution of values is left out; the default holds": ("DISTRIBUTION",),
    "imperfections are left out; the mesh is perfect": ("IMPERFECTION",),
}  # fmt: skip


def report_unused(model: AbaqusModel) -> None:
    """Say which keywords and elements the structure is made without."""
    by = {name: text for text, names in CONSEQUENCES.items() for name in names}
    behaviour = False
    for _, keyword in model.flat.keywords:
        name = keyword.name
        behaviour = name == "MATERIAL" or (behaviour and not name.endswith("SECTION") and name != "STEP")
        if name in READ or (behaviour and name not in by):
            continue
        model.found.unused(f"*{name}", by.get(name, "it is not understood and left out"), place_of(keyword))
    kinds: dict[str, list[str]] = {}
    for element in model.flat.elements.values():
        known = ("MASS", "ROTARYI", "SPRINGA", "SPRING1", "SPRING2", "DCOUP3D", "DISTRIBUTING")
        if (not element.cell and element.kind not in known) or element.kind.startswith(PLANE):
            kinds.setdefault(element.kind, []).append(element.place)
    for kind, places in kinds.items():
        file, _, line = places[0].rpartition(", line ")
        plane = "plane and axisymmetric elements are left out; a body is three-dimensional"
        text = plane if kind.startswith(PLANE) else "elements of this type are left out; what they join may be loose"
        from femflex.decks.findings import Place

        model.found.unused(f"elements {kind}", text, Place(file, int(line)), len(places))
