"""Point elements: *MASS, *ROTARY INERTIA and *SPRING."""

from __future__ import annotations

from functools import partial

import numpy as np

from femflex.arrays import Array
from femflex.decks.abaqus.model import AbaqusModel, location_of
from femflex.decks.abaqus.sections import SectionInputs
from femflex.fem.bushing import spring
from femflex.fem.point_mass import check_inertia
from femflex.mesh.formats.abaqus_flat import Element, InstanceKeyword
from femflex.mesh.formats.abaqus_keywords import Keyword


def read_masses(model: AbaqusModel, inputs: SectionInputs) -> None:
    """Add masses and inertias of nodes; those of one node are combined."""
    masses: dict[int, float] = {}
    inertias: dict[int, Array] = {}
    keyword_of_node: dict[int, Keyword] = {}

    def mass(entry: InstanceKeyword) -> None:
        keyword = entry.keyword
        m = keyword.real(keyword.data[0][0], 0, "a mass") * model.units.mass
        if keyword.parameter("type").upper().startswith("ANISO"):
            raise keyword.error(
                ", TYPE=ANISOTROPIC is not read: the mass of a point is alike in all directions; give one."
            )
        if m < 0:
            raise keyword.error(f": the mass is {m:.6g} kg; a mass cannot be negative.", 0)
        for element in _elements_of_keyword(model, entry):
            node = model.representative(element.nodes[0])
            masses[node] = masses.get(node, 0.0) + m
            keyword_of_node[node] = keyword

    def inertia(entry: InstanceKeyword) -> None:
        scope, keyword = entry
        I11, I22, I33, I12, I13, I23 = (
            [keyword.real(word, 0, "an inertia") * model.units.inertia for word in keyword.data[0]] + [0.0] * 6
        )[:6]
        J = np.array([[I11, I12, I13], [I12, I22, I23], [I13, I23, I33]])
        check_inertia(J, f"{keyword.location(0)}: *ROTARY INERTIA")
        system = inputs.system(keyword.parameter("orientation"), scope, keyword)
        for element in _elements_of_keyword(model, entry):
            node = model.representative(element.nodes[0])
            axes = np.eye(3) if system is None else system.axes_at(model.x(node))
            if system is None:
                axes = axes @ model.placement(scope).C.T
            inertias[node] = inertias.get(node, np.zeros((3, 3))) + axes.T @ J @ axes
            keyword_of_node[node] = keyword

    model.for_each_keyword(mass, "MASS")
    model.for_each_keyword(inertia, "ROTARY INERTIA")
    for node, keyword in keyword_of_node.items():
        label = f"{keyword.location()}: node {model.flat.label(node)}"
        model.add_mass(node, masses.get(node, 0.0), inertias.get(node), np.zeros(3), label, location_of(keyword))


def read_springs(model: AbaqusModel, inputs: SectionInputs) -> None:
    """Add springs: SPRINGA along the line between two nodes, SPRING1 to the body frame, SPRING2 between components
    along the axes of the spring's orientation at each node.

    Springs without ELSET after *JOINT belong to its elements (JOINTC) and act along the axes of its orientation.
    """
    joint = None
    for entry in model.flat.keywords:
        name = entry.keyword.name
        if name == "JOINT":
            joint = entry
            model.findings.use("*JOINT")
        elif name == "SPRING":
            of_joint = joint if not entry.keyword.parameter("elset") else None
            model.findings.use("*SPRING")
            model.attempt(entry.keyword, partial(_spring, model, inputs, entry, of_joint))
        elif name != "DASHPOT":
            joint = None


def _spring(model: AbaqusModel, inputs: SectionInputs, entry: InstanceKeyword, joint: InstanceKeyword | None) -> None:
    """Springs of a keyword's elements, or of those of a *JOINT between one component of both their nodes."""
    keyword, owner = entry.keyword, joint or entry
    system = inputs.system(owner.keyword.parameter("orientation"), owner.scope, owner.keyword)
    if "nonlinear" in keyword.parameters:
        model.findings.unused("NONLINEAR of *SPRING", "the spring is left out", location_of(keyword))
        return
    rows = keyword.data
    for element in _elements_of_keyword(model, owner):
        nodes = [model.representative(node) for node in element.nodes]
        is_axial = element.kind == "SPRINGA"
        k = next((j for j in range(0 if is_axial else 1, len(rows)) if rows[j] and rows[j][0]), None)
        if k is None:
            raise keyword.error("needs a component, and a stiffness in the next line; SPRINGA a stiffness alone.")
        stiffness = keyword.real(rows[k][0], k, "a stiffness")
        if not stiffness:
            model.findings.note(f"{keyword.location()}: springs of stiffness 0 are left out")
            return
        if is_axial:
            model.required.update(nodes)
            names = [model.group(node) for node in nodes]
            model.bushings.append(spring(names[0], names[1], stiffness * model.units.spring))
            continue
        components = [keyword.integer(word, 0, "a component") for word in rows[0] if word]
        if wrong := [c for c in components if not 1 <= c <= 6]:
            raise keyword.error(f"has component {wrong[0]}; components are 1 to 6.", 0)
        places = [nodes[0] if joint else node for node in nodes]
        axes = [np.eye(3) if system is None else system.axes_at(model.x(node)) for node in places]
        ends = list(zip(nodes, components * 2 if joint else components, axes, strict=False))
        model.bushings.append(model.scalar_spring(ends, stiffness, model.units))


def _elements_of_keyword(model: AbaqusModel, entry: InstanceKeyword) -> list[Element]:
    """Elements of the set named by a keyword."""
    scope, keyword = entry
    numbers = model.flat.elements_of(keyword.parameter("elset"), scope, keyword.location())
    elements = [model.flat.elements[number] for number in numbers if model.flat.elements[number].nodes]
    for element in elements:
        unknown = [node for node in element.nodes if node not in model.flat.nodes]
        if unknown:
            label = model.flat.label
            raise ValueError(
                f"{element.location}: element {label(element.number)} uses node {label(unknown[0], element.number)}, "
                "which no *NODE block defines."
            )
    return elements
