"""Connections of an Abaqus deck: *RIGID BODY, *COUPLING and its older forms, *MPC, *EQUATION and *TIE."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from femflex.arrays import Array
from femflex.decks.abaqus.axes import System
from femflex.decks.abaqus.model import AbaqusModel, location_of, plain_name
from femflex.decks.abaqus.sections import SectionInputs
from femflex.decks.abaqus.surfaces import Surfaces, surface_named
from femflex.fem import Distributing
from femflex.mesh.formats.abaqus_flat import InstanceKeyword
from femflex.mesh.formats.abaqus_keywords import Keyword

Transforms = Mapping[int, System]  # of nodes with *TRANSFORM

COINCIDENT = 1e-6  # of the model's extent: distance up to which two tied nodes coincide
ALL = (0, 1, 2, 3, 4, 5)
BASIC = np.eye(3)


def surface_nodes(model: AbaqusModel, surfaces: Surfaces, word: str, entry: InstanceKeyword) -> list[int]:
    """Nodes of a surface or node set named by a keyword."""
    scope, keyword = entry
    surface = surface_named(surfaces, word, scope)
    if surface is not None:
        return surface.nodes
    if model.flat.nsets.is_known(word, scope):
        return model.nodes_of(word, scope, keyword)
    raise keyword.error(f": surface {word!r} is not in the deck; it has {sorted({name for _, name in surfaces})[:20]}.")


def read_ties(model: AbaqusModel, surfaces: Surfaces) -> None:
    """Merge every tied node with the node that it coincides with; called before the elements are read."""

    def tie(entry: InstanceKeyword) -> None:
        keyword = entry.keyword
        if {"cyclicsymmetry", "multistage", "fluidperiodic"} & keyword.parameters.keys():
            model.findings.unused(
                "*TIE, CYCLIC SYMMETRY", "the structure is the sector that the deck holds, with free sides",
                location_of(keyword),
            )  # fmt: skip
            return
        for k, row in enumerate(keyword.data):
            slaves, masters = (surface_nodes(model, surfaces, word, entry) for word in row[:2])
            extent = float(np.linalg.norm(np.ptp(np.array(list(model.flat.nodes.values())), axis=0)))
            positions = np.array([model.flat.nodes[n] for n in masters])
            query = cKDTree(positions).query(np.array([model.flat.nodes[n] for n in slaves]))
            distances, nearest = np.asarray(query[0]), np.asarray(query[1])
            distant = [n for n, d in zip(slaves, distances, strict=True) if d > COINCIDENT * extent]
            if distant:
                raise keyword.error(
                    f"of {row[0]!r} to {row[1]!r}: {len(distant)} of {len(slaves)} nodes, the first is {distant[0]}, "
                    "have no node of the other surface at their place; surfaces are tied where their meshes match. "
                    "Make them match, or join them by *EQUATION or *COUPLING.",
                    k,
                )
            for node, index in zip(slaves, nearest.tolist(), strict=True):
                if model.representative(node) != model.representative(masters[index]):
                    model.merged[model.representative(node)] = model.representative(masters[index])

    model.for_each_keyword(tie, "TIE")


def read_connections(model: AbaqusModel, inputs: SectionInputs, surfaces: Surfaces, transforms: Transforms) -> None:
    """Add the connections of a deck to the model."""
    model.for_each_keyword(lambda entry: _rigid_body(model, entry), "RIGID BODY")
    model.for_each_keyword(lambda entry: _kinematic_coupling(model, inputs, entry), "KINEMATIC COUPLING")
    _couplings(model, inputs, surfaces)
    model.for_each_keyword(lambda entry: _distributing(model, entry), "DISTRIBUTING COUPLING")
    model.for_each_keyword(lambda entry: _mpc(model, entry), "MPC")
    model.for_each_keyword(lambda entry: _equation(model, transforms, entry), "EQUATION")


def _rigid(
    model: AbaqusModel, nodes: list[int], ref: int, components: tuple[int, ...], label: str, keyword: Keyword,
    system: System | None = None,
) -> None:  # fmt: skip
    """Make components of nodes depend rigidly on a reference node, along the axes of a system at each node."""
    ref = model.representative(ref)
    nodes = [node for node in dict.fromkeys(map(model.representative, nodes)) if node != ref]
    if not nodes or not all([model.depend(node, components, label, keyword) for node in nodes]):
        return
    axes = (lambda _: np.eye(3)) if system is None else (lambda node: system.axes_at(model.x(node)))
    model.add_rigid(plain_name(label), nodes, ref, tuple(c + 1 for c in components), axes)
    model.moving.update([ref, *nodes])
    model.turning.add(ref)


def _rigid_body(model: AbaqusModel, entry: InstanceKeyword) -> None:
    scope, keyword = entry
    ref = model.node_of(keyword.parameter("refnode"), scope, keyword)
    label = f"*RIGID BODY at node {model.flat.label(ref)}"
    if keyword.parameter("rotnode"):
        model.rotation_nodes[model.node_of(keyword.parameter("rotnode"), scope, keyword)] = ref
    nodes: list[int] = []
    if elset := keyword.parameter("elset"):
        for number in model.flat.elements_of(elset, scope, keyword.location()):
            nodes += model.flat.elements[number].nodes
    for name in ("nset", "tienset"):
        if keyword.parameter(name):
            nodes += model.nodes_of(keyword.parameter(name), scope, keyword)
    _rigid(model, nodes, ref, ALL, label, keyword)
    if pins := keyword.parameter("pinnset"):
        pinned = [node for node in model.nodes_of(pins, scope, keyword) if node not in nodes]
        _rigid(model, pinned, ref, (0, 1, 2), f"{label} pins", keyword)


def _component_range(keyword: Keyword, k: int, words: list[str]) -> tuple[int, ...]:
    """Components from the first to the last in a data line; all components if it names none."""
    filled = [word for word in words if word]
    if not filled:
        return ALL
    first = keyword.integer(filled[0], k, "a component")
    last = keyword.integer(filled[1], k, "a component") if len(filled) > 1 else first
    return tuple(c - 1 for c in range(first, last + 1) if 1 <= c <= 6)


def _kinematic_coupling(model: AbaqusModel, inputs: SectionInputs, entry: InstanceKeyword) -> None:
    scope, keyword = entry
    ref = model.node_of(keyword.parameter("refnode"), scope, keyword)
    system = inputs.system(keyword.parameter("orientation"), scope, keyword)
    nodes_by_components: dict[tuple[int, ...], list[int]] = {}
    for k, row in enumerate(keyword.data):
        if row[0]:
            nodes_by_components.setdefault(_component_range(keyword, k, row[1:3]), []).extend(
                model.nodes_of(row[0], scope, keyword, k)
            )
    for components, nodes in nodes_by_components.items():
        _rigid(model, nodes, ref, components, f"*KINEMATIC COUPLING at node {model.flat.label(ref)}", keyword, system)


def _couplings(model: AbaqusModel, inputs: SectionInputs, surfaces: Surfaces) -> None:
    """Add every *COUPLING, with the *KINEMATIC or *DISTRIBUTING keyword that follows it."""
    head: InstanceKeyword | None = None
    unpaired: list[InstanceKeyword | None] = []
    for entry in model.flat.keywords:
        if entry.keyword.name == "COUPLING":
            unpaired.append(head)
            head = entry
        elif entry.keyword.name in ("KINEMATIC", "DISTRIBUTING"):
            if head is None:
                unpaired.append(entry)
                continue
            model.findings.use("*COUPLING")
            model.findings.use(f"*{entry.keyword.name}")
            model.attempt(entry.keyword, partial(_coupling, model, inputs, surfaces, head, entry))
            head = None
    text = "a *COUPLING and one *KINEMATIC or *DISTRIBUTING after it make a coupling; parts may be unconnected"
    for lone in filter(None, [*unpaired, head]):
        model.findings.unused(f"*{lone.keyword.name}", text, location_of(lone.keyword))


def _coupling(
    model: AbaqusModel, inputs: SectionInputs, surfaces: Surfaces, head: InstanceKeyword, kind: InstanceKeyword
) -> None:
    scope, keyword = head
    ref = model.node_of(keyword.parameter("refnode"), scope, keyword)
    nodes = surface_nodes(model, surfaces, keyword.parameter("surface"), head)
    system = inputs.system(keyword.parameter("orientation"), scope, keyword)
    radius = keyword.parameter("influenceradius")
    if radius and radius.upper() != "WORLD":
        radius_value = float(radius)
        nodes = [n for n in nodes if np.linalg.norm(model.flat.nodes[n] - model.flat.nodes[ref]) <= radius_value]
    label = f"*COUPLING {keyword.parameter('constraintname') or ''} at node {model.flat.label(ref)}".replace("  ", " ")
    if kind.keyword.name == "KINEMATIC":
        components: set[int] = set()
        for k, row in enumerate(kind.keyword.data):
            components |= set(_component_range(kind.keyword, k, row[:2]))
        _rigid(model, nodes, ref, tuple(sorted(components)) or ALL, label, keyword, system)
        return
    _distribute(model, nodes, ref, None, label, keyword)


def _distributing(model: AbaqusModel, entry: InstanceKeyword) -> None:
    """Add a *DISTRIBUTING COUPLING: the reference node is that of its DCOUP3D element; weights by node or set."""
    scope, keyword = entry
    elements = [
        model.flat.elements[number]
        for number in model.flat.elements_of(keyword.parameter("elset"), scope, keyword.location())
    ]
    if not elements:
        raise keyword.error("names no DCOUP3D element; give one.")
    weights: dict[int, float] = {}
    for k, row in enumerate(keyword.data):
        for node in model.nodes_of(row[0], scope, keyword, k):
            weights[node] = keyword.real(row[1], k, "a weight") if len(row) > 1 and row[1] else 1.0
    ref = elements[0].nodes[0]
    _distribute(model, list(weights), ref, weights, f"*DISTRIBUTING COUPLING at node {model.flat.label(ref)}", keyword)


def _distribute(
    model: AbaqusModel, nodes: list[int], ref: int, weights: dict[int, float] | None, label: str, keyword: Keyword
) -> None:
    ref = model.representative(ref)
    nodes = [node for node in dict.fromkeys(map(model.representative, nodes)) if node != ref]
    if not nodes or not model.depend(ref, ALL, label, keyword):
        return
    name = model.group_of(nodes, label)
    order = sorted(nodes, key=model.row)
    ordered_weights = None if weights is None else tuple(weights.get(node, 1.0) for node in order)
    model.connections.append(Distributing(group=name, reference=model.group(ref), weights=ordered_weights))
    model.required.update(nodes)
    model.moving.add(ref)
    model.turning.add(ref)


def _mpc(model: AbaqusModel, entry: InstanceKeyword) -> None:
    """Add BEAM, TIE, PIN and LINK between pairs of nodes, or a set and a node; the first is dependent."""
    scope, keyword = entry
    for k, row in enumerate(keyword.data):
        kind = row[0].upper()
        words = [word for word in row[1:] if word]
        if kind not in ("BEAM", "TIE", "PIN", "LINK") or len(words) != 2:
            model.findings.unused(f"*MPC {kind}", "it is left out; parts may be unconnected", location_of(keyword, k))
            continue
        first, second = (model.nodes_of(word, scope, keyword, k) for word in words)
        second = second * len(first) if len(second) == 1 else second
        if len(first) != len(second):
            raise keyword.error(f"{kind} of {len(first)} nodes to {len(second)}; give as many.", k)
        for node, other in zip(first, second, strict=True):
            label = f"*MPC {kind} of node {model.flat.label(node)}"
            if kind == "BEAM":
                _rigid(model, [node], other, ALL, label, keyword)
                continue
            if kind == "LINK":
                _link(model, node, other, label, keyword)
                continue
            components = ALL if kind == "TIE" else (0, 1, 2)
            _add_multi_point(model, node, components, [other], np.eye(6)[list(components)], label, keyword)


def _link(model: AbaqusModel, node: int, other: int, label: str, keyword: Keyword) -> None:
    """Keep the distance between two nodes: the node's component closest to their line is dependent."""
    t = model.x(other) - model.x(node)
    if not np.linalg.norm(t) > 0:
        raise ValueError(f"{label}: its two nodes are at one place; give TIE or PIN.")
    c = int(np.abs(t).argmax())
    _add_multi_point(model, node, (c,), *model.link(node, other, c + 1, BASIC), label, keyword)


def _equation(model: AbaqusModel, transforms: Transforms, entry: InstanceKeyword) -> None:
    """Add equations of terms (node or set, component, factor), four per line; the first component is dependent."""
    scope, keyword = entry
    if "remove" in keyword.parameters:
        model.findings.unused("*EQUATION, REMOVE", "the equations stay", location_of(keyword))
        return
    k = 0
    while k < len(keyword.data):
        count, start = keyword.integer(keyword.data[k][0], k, "the number of terms"), k
        words: list[str] = []
        k += 1
        while len(words) < 3 * count and k < len(keyword.data):
            words += [word for word in keyword.data[k] if word]
            k += 1
        if len(words) < 3 * count:
            raise keyword.error(f": an equation of {count} terms has {len(words) // 3} of them.", start)
        terms = [
            (
                model.nodes_of(words[3 * j], scope, keyword, start),
                keyword.integer(words[3 * j + 1], start, "a component") - 1,
                keyword.real(words[3 * j + 2], start, "a factor"),
            )
            for j in range(count)
        ]
        pairs = max(len(nodes) for nodes, _, _ in terms)
        for i in range(pairs):
            pair_terms = [(nodes[i if len(nodes) > 1 else 0], c, factor) for nodes, c, factor in terms]
            _equation_of(model, transforms, pair_terms, keyword, start)


def _equation_of(
    model: AbaqusModel, transforms: Transforms, terms: list[tuple[int, int, float]], keyword: Keyword, row: int
) -> None:
    """Add one equation between components of nodes, along the axes of *TRANSFORM if a node has them."""

    def axes(node: int) -> Array:
        transform = transforms.get(model.representative(node))
        return np.eye(3) if transform is None else transform.axes_at(model.x(node))

    terms = [_rotation_term(model, *term) for term in terms]
    (node, c, first), *others = terms
    if not first or not 0 <= c < 6:
        raise keyword.error(
            f": the first term is the dependent component; found factor {first:g} and component {c + 1}. Give a factor "
            "other than 0 and a component of 1 to 6.", row
        )  # fmt: skip
    if wrong := [k for _, k, _ in others if not 0 <= k < 6]:
        raise keyword.error(f": component {wrong[0] + 1} is not one of 1 to 6.", row)
    numbered = [(node, c + 1, first), *((model.representative(other), k + 1, factor) for other, k, factor in others)]
    leaders, matrix = model.equation(numbered, axes, model.units.length)
    _add_multi_point(
        model, node, (c,), leaders, matrix, f"*EQUATION at {location_of(keyword, row)}", keyword, axes(node)
    )


def _rotation_term(model: AbaqusModel, node: int, c: int, factor: float) -> tuple[int, int, float]:
    """The term itself, or, for a node whose displacements are rotations of another node, the term of that rotation."""
    ref = model.rotation_nodes.get(node)
    return (node, c, factor) if ref is None else (ref, c + 3, factor)


def _add_multi_point(
    model: AbaqusModel, node: int, components: tuple[int, ...], leaders: list[int], matrix: Array, label: str,
    keyword: Keyword, axes: Array = BASIC,
) -> None:  # fmt: skip
    node = model.representative(node)
    if not model.depend(node, components, label, keyword):
        return
    leaders = [model.representative(other) for other in leaders]
    model.add_equations(node, tuple(c + 1 for c in components), leaders, matrix, axes, label)
    if any(c >= 3 for c in components):
        model.required_turning.add(node)
