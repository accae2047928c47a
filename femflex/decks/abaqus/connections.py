"""Connections of an Abaqus deck: *RIGID BODY, *COUPLING and its older kin, *MPC, *EQUATION and *TIE."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from femflex.arrays import Array
from femflex.decks.abaqus.axes import System
from femflex.decks.abaqus.model import WORDS, AbaqusModel, place_of
from femflex.decks.abaqus.sections import Reading
from femflex.decks.builder import direction_key
from femflex.fem import Distributing, MultiPointConstraint, Rigid
from femflex.fem.support import GLOBAL, Rows
from femflex.mesh.abaqus_flat import Scoped
from femflex.mesh.abaqus_keywords import Keyword

Surfaces = dict[tuple[str, str], list[int]]
Transforms = Mapping[int, System]  # of nodes with *TRANSFORM

SAME_PLACE = 1e-6  # of the model's extent: distance at which two tied nodes are at one place
ALL = (0, 1, 2, 3, 4, 5)


def surface_nodes(model: AbaqusModel, surfaces: Surfaces, word: str, one: Scoped) -> list[int]:
    """Nodes of a surface, or of a set of nodes, as a keyword names it."""
    scope, keyword = one
    instance, _, rest = word.upper().rpartition(".")
    for key in ((scope.upper(), word.upper()), ("", word.upper()), (instance, rest)):
        if key in surfaces:
            return surfaces[key]
    own = [nodes for (_, name), nodes in surfaces.items() if name == word.upper()]
    if len(own) == 1:
        return own[0]
    if model.flat.nsets.knows(word, scope):
        return model.nodes_of(word, scope, keyword)
    raise ValueError(
        f"{keyword.place()}: surface {word!r} is not in the deck; it has {sorted({name for _, name in surfaces})[:20]}."
    )


def read_ties(model: AbaqusModel, surfaces: Surfaces) -> None:
    """Make one node of every tied node and the one that it coincides with; before the elements are read."""

    def tie(one: Scoped) -> None:
        keyword = one.keyword
        if {"cyclicsymmetry", "multistage", "fluidperiodic"} & keyword.parameters.keys():
            model.found.unused(
                "*TIE, CYCLIC SYMMETRY", "the structure is the sector that the deck holds, with free sides",
                place_of(keyword),
            )  # fmt: skip
            return
        for k, row in enumerate(keyword.data):
            slaves, masters = (surface_nodes(model, surfaces, word, one) for word in row[:2])
            extent = float(np.linalg.norm(np.ptp(np.array(list(model.flat.nodes.values())), axis=0)))
            places = np.array([model.flat.nodes[n] for n in masters])
            found = cKDTree(places).query(np.array([model.flat.nodes[n] for n in slaves]))
            far, nearest = np.asarray(found[0]), np.asarray(found[1])
            apart = [n for n, d in zip(slaves, far, strict=True) if d > SAME_PLACE * extent]
            if apart:
                raise ValueError(
                    f"{keyword.place(k)}: *TIE of {row[0]!r} to {row[1]!r}: {len(apart)} of {len(slaves)} nodes, the "
                    f"first is {apart[0]}, have no node of the other surface at their place; surfaces are tied where "
                    "their meshes match. Make them match, or join them by *EQUATION or *COUPLING."
                )
            for node, other in zip(slaves, nearest.tolist(), strict=True):
                if model.same(node) != model.same(masters[other]):
                    model.merged[model.same(node)] = model.same(masters[other])

    model.trying(tie, "TIE")


def read_connections(model: AbaqusModel, reading: Reading, surfaces: Surfaces, transforms: Transforms) -> None:
    """Add the connections of a deck to the model."""
    model.trying(lambda one: _rigid_body(model, one), "RIGID BODY")
    model.trying(lambda one: _kinematic_coupling(model, reading, one), "KINEMATIC COUPLING")
    _couplings(model, reading, surfaces)
    model.trying(lambda one: _distributing(model, one), "DISTRIBUTING COUPLING")
    model.trying(lambda one: _mpc(model, one), "MPC")
    model.trying(lambda one: _equation(model, transforms, one), "EQUATION")


def _rigid(
    model: AbaqusModel, nodes: list[int], ref: int, components: tuple[int, ...], what: str, k: Keyword,
    system: System | None = None,
) -> None:  # fmt: skip
    """Let components of nodes follow a reference node, rigidly; along the axes of a system at each node."""
    ref = model.same(ref)
    nodes = [node for node in dict.fromkeys(map(model.same, nodes)) if node != ref]
    if not nodes or not all([model.depend(node, components, what, k) for node in nodes]):
        return
    words = tuple(WORDS[c] for c in components)
    by: dict[tuple[float, ...], list[int]] = {}
    for node in nodes:
        by.setdefault(direction_key((np.eye(3) if system is None else system.at(model.x(node))).ravel()), []).append(
            node
        )
    for axes, own in by.items():
        rows = tuple(axes[j : j + 3] for j in (0, 3, 6))
        model.connections.append(Rigid(model.group_of(own, what), model.group(ref), words, rows))  # type: ignore[arg-type]
    model.moving.update([ref, *nodes])
    model.turning.add(ref)


def _rigid_body(model: AbaqusModel, one: Scoped) -> None:
    scope, keyword = one
    ref = model.node_of(keyword.parameter("refnode"), scope, keyword)
    what = f"*RIGID BODY at node {model.flat.label(ref)}"
    if keyword.parameter("rotnode"):
        model.rotation_nodes[model.node_of(keyword.parameter("rotnode"), scope, keyword)] = ref
    nodes: list[int] = []
    if elset := keyword.parameter("elset"):
        for number in model.flat.elements_of(elset, scope, keyword.place()):
            nodes += model.flat.elements[number].nodes
    for name in ("nset", "tienset"):
        if keyword.parameter(name):
            nodes += model.nodes_of(keyword.parameter(name), scope, keyword)
    _rigid(model, nodes, ref, ALL, what, keyword)
    if pins := keyword.parameter("pinnset"):
        own = [node for node in model.nodes_of(pins, scope, keyword) if node not in nodes]
        _rigid(model, own, ref, (0, 1, 2), f"{what} pins", keyword)


def _range(keyword: Keyword, k: int, words: list[str]) -> tuple[int, ...]:
    """Components from the first to the last that a data line names; all where it names none."""
    given = [word for word in words if word]
    if not given:
        return ALL
    first = keyword.integer(given[0], k, "a component")
    last = keyword.integer(given[1], k, "a component") if len(given) > 1 else first
    return tuple(c - 1 for c in range(first, last + 1) if 1 <= c <= 6)


def _kinematic_coupling(model: AbaqusModel, reading: Reading, one: Scoped) -> None:
    scope, keyword = one
    ref = model.node_of(keyword.parameter("refnode"), scope, keyword)
    system = reading.system(keyword.parameter("orientation"), scope, keyword)
    by: dict[tuple[int, ...], list[int]] = {}
    for k, row in enumerate(keyword.data):
        if row[0]:
            by.setdefault(_range(keyword, k, row[1:3]), []).extend(model.nodes_of(row[0], scope, keyword, k))
    for components, nodes in by.items():
        _rigid(model, nodes, ref, components, f"*KINEMATIC COUPLING at node {model.flat.label(ref)}", keyword, system)


def _couplings(model: AbaqusModel, reading: Reading, surfaces: Surfaces) -> None:
    """*COUPLING with the *KINEMATIC or *DISTRIBUTING that follows it."""
    head: Scoped | None = None
    alone: list[Scoped] = []
    for one in model.flat.keywords:
        if one.keyword.name == "COUPLING":
            if head is not None:
                alone.append(head)
            head = one
        elif one.keyword.name in ("KINEMATIC", "DISTRIBUTING"):
            if head is None:
                alone.append(one)
                continue
            model.found.use("*COUPLING")
            model.attempt(one.keyword, partial(_coupling, model, reading, surfaces, head, one))
            head = None
    if head is not None:
        alone.append(head)
    for one in alone:
        model.found.unused(
            f"*{one.keyword.name}",
            "a *COUPLING and one *KINEMATIC or *DISTRIBUTING after it make a coupling; parts may be unconnected",
            place_of(one.keyword),
        )


def _coupling(model: AbaqusModel, reading: Reading, surfaces: Surfaces, head: Scoped, kind: Scoped) -> None:
    scope, keyword = head
    ref = model.node_of(keyword.parameter("refnode"), scope, keyword)
    nodes = surface_nodes(model, surfaces, keyword.parameter("surface"), head)
    system = reading.system(keyword.parameter("orientation"), scope, keyword)
    radius = keyword.parameter("influenceradius")
    if radius and radius.upper() != "WORLD":
        far = float(radius)
        nodes = [n for n in nodes if np.linalg.norm(model.flat.nodes[n] - model.flat.nodes[ref]) <= far]
    what = f"*COUPLING {keyword.parameter('constraintname') or ''} at node {model.flat.label(ref)}".replace("  ", " ")
    if kind.keyword.name == "KINEMATIC":
        components: set[int] = set()
        for k, row in enumerate(kind.keyword.data):
            components |= set(_range(kind.keyword, k, row[:2]))
        _rigid(model, nodes, ref, tuple(sorted(components)) or ALL, what, keyword, system)
        return
    _spread(model, nodes, ref, None, what, keyword)


def _distributing(model: AbaqusModel, one: Scoped) -> None:
    """*DISTRIBUTING COUPLING of the reference node that its DCOUP3D element has; weights by node or set."""
    scope, keyword = one
    elements = [
        model.flat.elements[number]
        for number in model.flat.elements_of(keyword.parameter("elset"), scope, keyword.place())
    ]
    if not elements:
        raise ValueError(f"{keyword.place()}: *DISTRIBUTING COUPLING names no DCOUP3D element; give one.")
    weights: dict[int, float] = {}
    for k, row in enumerate(keyword.data):
        for node in model.nodes_of(row[0], scope, keyword, k):
            weights[node] = keyword.real(row[1], k, "a weight") if len(row) > 1 and row[1] else 1.0
    ref = elements[0].nodes[0]
    _spread(model, list(weights), ref, weights, f"*DISTRIBUTING COUPLING at node {model.flat.label(ref)}", keyword)


def _spread(
    model: AbaqusModel, nodes: list[int], ref: int, weights: dict[int, float] | None, what: str, keyword: Keyword
) -> None:
    ref = model.same(ref)
    nodes = [node for node in dict.fromkeys(map(model.same, nodes)) if node != ref]
    if not nodes or not model.depend(ref, ALL, what, keyword):
        return
    name = model.group_of(nodes, what)
    order = sorted(nodes, key=model.row)
    given = None if weights is None else tuple(weights.get(node, 1.0) for node in order)
    model.connections.append(Distributing(name, model.group(ref), given))
    model.wanted.update(nodes)
    model.moving.add(ref)
    model.turning.add(ref)


def _mpc(model: AbaqusModel, one: Scoped) -> None:
    """BEAM, TIE, PIN and LINK between pairs of nodes, or a set and a node; the first follows."""
    scope, keyword = one
    for k, row in enumerate(keyword.data):
        kind = row[0].upper()
        words = [word for word in row[1:] if word]
        if kind not in ("BEAM", "TIE", "PIN", "LINK") or len(words) != 2:
            model.found.unused(f"*MPC {kind}", "it is left out; parts may be unconnected", place_of(keyword, k))
            continue
        first, second = (model.nodes_of(word, scope, keyword, k) for word in words)
        second = second * len(first) if len(second) == 1 else second
        if len(first) != len(second):
            raise ValueError(f"{keyword.place(k)}: *MPC {kind} of {len(first)} nodes to {len(second)}; give as many.")
        for node, other in zip(first, second, strict=True):
            what = f"*MPC {kind} of node {model.flat.label(node)}"
            if kind == "BEAM":
                _rigid(model, [node], other, ALL, what, keyword)
                continue
            if kind == "LINK":
                _link(model, node, other, what, keyword)
                continue
            components = ALL if kind == "TIE" else (0, 1, 2)
            _follow(model, node, components, {other: np.eye(6)[list(components)]}, what, keyword)


def _link(model: AbaqusModel, node: int, other: int, what: str, keyword: Keyword) -> None:
    """The distance between two nodes is kept: the node's component that lies nearest to their line follows."""
    t = model.x(other) - model.x(node)
    if not np.linalg.norm(t) > 0:
        raise ValueError(f"{what}: its two nodes are at one place; give TIE or PIN.")
    c = int(np.abs(t).argmax())
    row = np.concatenate([t / t[c], np.zeros(3)])
    own = -row
    own[c] = 0.0
    _follow(model, node, (c,), {other: row[None], node: own[None]}, what, keyword)


def _equation(model: AbaqusModel, transforms: Transforms, one: Scoped) -> None:
    """Terms (node or set, component, factor), four in a line; the first follows the others."""
    scope, keyword = one
    if "remove" in keyword.parameters:
        model.found.unused("*EQUATION, REMOVE", "the equations stay", place_of(keyword))
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
            raise ValueError(f"{keyword.place(start)}: an equation of {count} terms has {len(words) // 3} of them.")
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
            own = [(nodes[i if len(nodes) > 1 else 0], c, factor) for nodes, c, factor in terms]
            _equation_of(model, transforms, own, keyword, start)


def _equation_of(
    model: AbaqusModel, transforms: Transforms, terms: list[tuple[int, int, float]], keyword: Keyword, row: int
) -> None:
    """One equation between components of nodes, along the axes of *TRANSFORM where a node has them."""

    def axes(node: int) -> Array:
        own = transforms.get(model.same(node))
        return np.eye(3) if own is None else own.at(model.x(node))

    terms = [_turned(model, *term) for term in terms]
    (node, c, first), *others = terms
    if not first or not 0 <= c < 6:
        raise ValueError(
            f"{keyword.place(row)}: the first term of an equation is the dependent component; found factor {first:g} "
            f"and component {c + 1}. Give a factor other than 0 and a component of 1 to 6."
        )
    length = model.units.length
    matrix: dict[int, Array] = {}
    for other, k, factor in others:
        if not 0 <= k < 6:
            raise ValueError(f"{keyword.place(row)}: component {k + 1} of an equation is not one of 1 to 6.")
        unit = length ** ((1 if c < 3 else 0) - (1 if k < 3 else 0))
        own = matrix.setdefault(model.same(other), np.zeros((1, 6)))
        turns = 3 * (k // 3)
        own[0, turns : turns + 3] -= factor / first * unit * axes(other)[k % 3]
    _follow(model, node, (c,), matrix, f"*EQUATION at {place_of(keyword, row)}", keyword, tuple(map(tuple, axes(node))))


def _turned(model: AbaqusModel, node: int, c: int, factor: float) -> tuple[int, int, float]:
    """A term of a node whose displacements are rotations of another, as that rotation."""
    ref = model.rotation_nodes.get(node)
    return (node, c, factor) if ref is None else (ref, c + 3, factor)


def _follow(
    model: AbaqusModel, node: int, components: tuple[int, ...], matrix: dict[int, Array], what: str, keyword: Keyword,
    axes: Rows = GLOBAL,
) -> None:  # fmt: skip
    node = model.same(node)
    if not model.depend(node, components, what, keyword):
        return
    leaders = list(matrix) or [node]
    values = np.hstack([matrix.get(other, np.zeros((len(components), 6))) for other in leaders])
    words = tuple(WORDS[c] for c in components)
    model.connections.append(
        MultiPointConstraint(model.group(node), words, tuple(map(model.group, leaders)), values, axes, what)
    )
    model.wanted.update([node, *leaders])
    if any(c >= 3 for c in components):
        model.wanted_turning.add(node)
    model.wanted_turning.update(other for other in leaders if np.any(matrix.get(other, np.zeros((1, 6)))[:, 3:]))
