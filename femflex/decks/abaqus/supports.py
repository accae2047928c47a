"""Supports of an Abaqus deck: *BOUNDARY of the model and of every step, along the directions of *TRANSFORM."""

from __future__ import annotations

from functools import partial

import numpy as np

from femflex.decks.abaqus.axes import System
from femflex.decks.abaqus.model import WORDS, AbaqusModel, place_of
from femflex.decks.builder import direction_key
from femflex.fem import Support
from femflex.mesh.abaqus_flat import Scoped

Held = dict[str, Support]
State = dict[int, set[int]]  # node -> components 0 to 5

NAMED = {
    "ENCASTRE": (0, 1, 2, 3, 4, 5), "PINNED": (0, 1, 2),
    "XSYMM": (0, 4, 5), "YSYMM": (1, 3, 5), "ZSYMM": (2, 3, 4),
    "XASYMM": (1, 2, 3), "YASYMM": (0, 2, 4), "ZASYMM": (0, 1, 5),
}  # fmt: skip


def read_supports(model: AbaqusModel, transforms: dict[int, System]) -> tuple[dict[str, Held], tuple[str, ...]]:
    """Supports by name, initial and step 1 ..., each with all that hold then; and the one in force.

    That is the first step with *FREQUENCY, else the last step before any, else the model's own.
    """
    earlier: State = {}
    state: State = {}  # of the present step, whose blocks hold together
    states: dict[str, State] = {}
    step, chosen = 0, ""
    for one in model.flat.keywords:
        name = one.keyword.name
        if name == "STEP":
            states[_name(step)] = earlier = _together(earlier, state)  # of what comes before it
            step, state = step + 1, {}
        elif name == "FREQUENCY" and step and not chosen:
            chosen = f"step {step}"
        elif name == "BOUNDARY":
            model.found.use("*BOUNDARY")
            if one.keyword.parameter("op").upper() == "NEW":
                earlier = {}
            model.attempt(one.keyword, partial(_boundary, model, one, state))
    states[_name(step)] = _together(earlier, state)
    chosen = chosen if chosen in states else ("step 1" if "step 1" in states else "initial")
    sets = {name: _held(model, own, name, transforms) for name, own in states.items()}
    return sets, (chosen,)


def _together(a: State, b: State) -> State:
    return {node: a.get(node, set()) | b.get(node, set()) for node in (*a, *b)}


def _name(step: int) -> str:
    return f"step {step}" if step else "initial"


def _boundary(model: AbaqusModel, one: Scoped, state: State) -> None:
    scope, keyword = one
    kind = keyword.parameter("type").upper()
    if "submodel" in keyword.parameters or kind in ("VELOCITY", "ACCELERATION"):
        model.found.unused(
            f"*BOUNDARY, {kind or 'SUBMODEL'}",
            "prescribed motion is left out; prescribe it in the case",
            place_of(keyword),
        )
        return
    for k, row in enumerate(keyword.data):
        if not row[0]:
            continue
        nodes = model.nodes_of(row[0], scope, keyword, k)
        words = row[1:]
        if words and words[0].upper() in NAMED:
            components: tuple[int, ...] = NAMED[words[0].upper()]
        else:
            if not words or not words[0]:
                raise ValueError(f"{keyword.place(k)}: *BOUNDARY names no component of {row[0]!r}; give 1 to 6.")
            first = keyword.integer(words[0], k, "a component")
            last = keyword.integer(words[1], k, "a component") if len(words) > 1 and words[1] else first
            components = tuple(c - 1 for c in range(first, last + 1) if 1 <= c <= 6)
            if not components:
                model.found.unused(
                    "*BOUNDARY of other components", "temperatures and pressures are left out", place_of(keyword, k)
                )
                continue
            if len(words) > 2 and words[2] and keyword.real(words[2], k, "a displacement"):
                model.found.unused(
                    "*BOUNDARY that is not zero", "the component is held at zero; prescribe motion in the case",
                    place_of(keyword, k),
                )  # fmt: skip
        for node in nodes:
            ref = model.rotation_nodes.get(node)
            if ref is not None:
                state.setdefault(model.same(ref), set()).update(c + 3 for c in components if c < 3)
            else:
                state.setdefault(model.same(node), set()).update(components)


def _held(model: AbaqusModel, state: State, name: str, transforms: dict[int, System]) -> Held:
    """Groups of nodes with the same components along the same axes."""
    by: dict[tuple[tuple[int, ...], tuple[float, ...]], list[int]] = {}
    for node, components in state.items():
        if node not in model.moving:
            continue
        own = {c for c in components if c < 3 or node in model.turning}
        follows = {c for c in own if (node, c) in model.depending}
        if follows:
            model.found.note(
                f"{name}: components {sorted(c + 1 for c in follows)} of node {model.flat.label(node)} are supported, "
                f"but depend on others by {model.depending[node, min(follows)]}; this support is left out, so support "
                "the others"
            )
            own -= follows
        if own:
            axes = transforms[node].at(model.x(node)) if node in transforms else np.eye(3)
            by.setdefault((tuple(sorted(own)), direction_key(axes.ravel())), []).append(node)
    held: Held = {}
    for (held_components, key), nodes in by.items():
        words = tuple(WORDS[c] for c in held_components)
        group = model.group_of(nodes, f"{name} {' '.join(words)}")
        rows = np.array(key).reshape(3, 3)
        held[group] = Support(words, tuple(map(tuple, rows.tolist())))
    return held
