"""Static loads of an Abaqus deck: *CLOAD, *DLOAD and *DSLOAD of every step."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from femflex.decks.abaqus.axes import System
from femflex.decks.abaqus.model import AbaqusModel, location_of
from femflex.decks.abaqus.surfaces import FACES, Surfaces, surface_named
from femflex.decks.cell_loads import Cell, cells_of, on_cell, on_face, on_line
from femflex.fem.static_loads import StaticLoads
from femflex.mesh.cells import CELL_TYPES
from femflex.mesh.formats.abaqus_flat import InstanceKeyword

KEYWORDS = ("CLOAD", "DLOAD", "DSLOAD")
MASS_TYPES = ("MASS", "ROTARYI")
PERTURBING = ("FREQUENCY", "BUCKLE")  # procedures whose steps have their own loads alone
OTHER_KINDS = {"imaginary", "loadcase", "user", "submodel", "sector", "orientation", "cyclicmode"}
Place = tuple[str, int, int]  # label, number of the node or element, and component or face
Loads = Iterator[tuple[Place, StaticLoads]]
State = dict[tuple[str, Place], list[StaticLoads]]  # loads by their keyword and place


def read_loads(model: AbaqusModel, surfaces: Surfaces, transforms: Mapping[int, System]) -> dict[str, StaticLoads]:
    """Sets of loads by name, "step 1" ..., each with all loads active in that step.

    Loads of one step add up. They replace those of earlier steps at the same place, which stay otherwise; with OP=NEW,
    and in steps of perturbation, earlier ones end. A line that is not understood is left out of its step, and listed.
    """
    readers: dict[str, Callable[[InstanceKeyword, int], Loads]] = {
        "CLOAD": lambda entry, k: _at_nodes(model, transforms, entry, k),
        "DLOAD": lambda entry, k: _on_elements(model, entry, k),
        "DSLOAD": lambda entry, k: _on_surface(model, surfaces, entry, k),
    }
    earlier: State = {}
    state: State = {}
    sets: dict[str, StaticLoads] = {}
    step, perturbing = 0, False

    def close() -> None:
        nonlocal earlier
        active = state if perturbing else earlier | state
        if parts := _parts(model, active, f"step {step}"):
            sets[f"step {step}"] = StaticLoads.combined(parts)
        earlier = earlier if perturbing else active

    for entry in model.flat.keywords:
        keyword = entry.keyword
        if keyword.name == "STEP":
            close()
            step, state, perturbing = step + 1, {}, "perturbation" in keyword.parameters
        perturbing |= keyword.name in PERTURBING
        if keyword.name not in KEYWORDS:
            continue
        if keyword.parameter("op").upper() == "NEW" and not perturbing:
            earlier = {key: loads for key, loads in earlier.items() if key[0] != keyword.name}
        if keyword.parameters.keys() & OTHER_KINDS:
            kinds = ", ".join(sorted(word.upper() for word in keyword.parameters.keys() & OTHER_KINDS))
            model.findings.unused(f"*{keyword.name}, {kinds}", "such loads are left out", location_of(keyword))
            continue
        if keyword.parameter("amplitude"):
            text = "amplitudes are left out; give the load a level in the case"
            model.findings.unused(f"*{keyword.name}, AMPLITUDE", text, location_of(keyword))
        for k, row in enumerate(keyword.data):
            try:
                for place, loads in [*readers[keyword.name](entry, k)] if any(row) else []:
                    state.setdefault((keyword.name, place), []).append(loads)
            except ValueError as error:
                text = f"left out of step {step}: {error}"
                model.findings.unused(f"*{keyword.name}", text, location_of(keyword, k))
        model.findings.use(f"*{keyword.name}")
    close()
    return sets


def _at_nodes(model: AbaqusModel, transforms: Mapping[int, System], entry: InstanceKeyword, k: int) -> Loads:
    """*CLOAD: node or set, component, magnitude, along the axes of *TRANSFORM."""
    scope, keyword = entry
    row = [*keyword.data[k], "", ""]
    component, size = keyword.integer(row[1], k, "a component") - 1, keyword.real(row[2], k, "a magnitude")
    if not 0 <= component < 6:
        raise ValueError("components other than 1 to 6 are not understood")
    for node in model.nodes_of(row[0], scope, keyword, k):
        reference = model.rotation_nodes.get(node)
        is_force = component < 3 and reference is None
        turned = model.representative(node if reference is None else reference)
        axes = transforms[node].axes_at(model.x(node)) if node in transforms else np.eye(3)
        yield ("", node, component), model.nodal_load(turned, size * axes[component % 3], is_force, model.units)


def _on_elements(model: AbaqusModel, entry: InstanceKeyword, k: int) -> Loads:
    """*DLOAD: element or set, label, magnitude, and of GRAV a direction.

    P acts along the normal of shells, P1 to P6 into faces of solids, PX to PZ per length of beams and trusses, BX to BZ
    per volume of solids, and GRAV per mass.
    """
    scope, keyword = entry
    row = [*keyword.data[k], "", "", "", "", ""]
    label, size, build, u = row[1].upper(), keyword.real(row[2], k, "a magnitude"), model.build, model.units
    named = model.flat.elements_of(row[0], scope, keyword.location(k)) if row[0] else [*model.flat.elements]
    axis = np.eye(3)["XYZ".find(label[-1:])]
    for number in named:
        if label == "GRAV":
            direction = np.array([keyword.real(word, k, "a direction") for word in row[3:6]])
            acceleration = size * direction / np.linalg.norm(direction) * u.length / u.time**2
            yield (label, number, 0), StaticLoads.weight(acceleration)
        elif label == "P":
            for cell in cells_of(build, number, 2):
                yield (label, number, 0), _pressure(model, cell, size)
        elif label in ("P1", "P2", "P3", "P4", "P5", "P6"):
            for cell in cells_of(build, number, 3):
                yield (label, number, 0), _pressure(model, cell, size, int(label[1]))
        elif label in ("PX", "PY", "PZ"):
            bends = model.flat.elements[number].kind.startswith("B")
            for cell in cells_of(build, number, 1):
                yield (label, number, 0), on_line(build, cell, size * u.spring * axis, bends)
        elif label in ("BX", "BY", "BZ"):
            for cell in cells_of(build, number, 3):
                force = np.tile(size * u.force / u.length**3 * axis, (CELL_TYPES[cell[0]].n_corners, 1))
                yield (label, number, 0), on_cell(build, cell, force)
        else:
            raise ValueError(f"{label} is not understood")


def _on_surface(model: AbaqusModel, surfaces: Surfaces, entry: InstanceKeyword, k: int) -> Loads:
    """*DSLOAD: surface, P, magnitude, which pushes against the normal of the surface."""
    row = [*entry.keyword.data[k], "", ""]
    surface, size = surface_named(surfaces, row[0], entry.scope), entry.keyword.real(row[2], k, "a magnitude")
    if row[1].upper() != "P":
        raise ValueError(f"{row[1].upper()} is not understood")
    if surface is None or not surface.faces:
        raise ValueError(f"{row[0]!r} is no surface of elements")
    for number, label in surface.faces:
        if label in ("SPOS", "SNEG"):
            for cell in cells_of(model.build, number, 2):
                yield (row[0], number, label == "SPOS"), _pressure(model, cell, -size if label == "SPOS" else size)
        elif label[:1] == "S" and label[1:].isdigit():
            for cell in cells_of(model.build, number, 3):
                yield (row[0], number, int(label[1:])), _pressure(model, cell, size, int(label[1:]))
        else:
            raise ValueError(f"faces {label or 'without a label'} are not understood")


def _pressure(model: AbaqusModel, cell: Cell, size: float, face: int = 0) -> StaticLoads:
    """A pressure along the normal of a shell, or into a face of a solid by its number 1 to 6."""
    kind, p = CELL_TYPES[cell[0]], size * model.units.pressure
    if not face:
        return on_cell(model.build, cell, np.full(kind.n_corners, p))
    faces = FACES[kind.shape]
    if face > len(faces):
        raise ValueError(f"an element that it names has no face {face}")
    return on_face(model.build, cell, faces[face - 1], np.full(len(faces[face - 1]), p))


def _parts(model: AbaqusModel, active: State, name: str) -> list[tuple[float, StaticLoads]]:
    """The loads of a step with their factors; weight counts if it acts alike on all elements with mass."""
    weights: dict[int, tuple[float, ...]] = {}
    parts = []
    for (_, (label, number, _)), loads in active.items():
        if label == "GRAV":
            weights[number] = tuple(np.sum([one.acceleration for one in loads], axis=0).tolist())
        else:
            parts += [(1.0, one) for one in loads]
    heavy = {e.number for e in model.flat.elements.values() if e.number in model.build.cell_of or e.kind in MASS_TYPES}
    if heavy <= weights.keys() and len(pulls := {weights[number] for number in heavy}) == 1:
        parts.append((1.0, StaticLoads.weight(pulls.pop())))
    elif weights:
        keyword = next(model.keywords_named("DLOAD", use=False)).keyword
        text = f"left out of {name}: it does not act alike on all elements with mass"
        model.findings.unused("*DLOAD, GRAV", text, location_of(keyword))
    return parts
