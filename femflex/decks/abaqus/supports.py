"""Supports of an Abaqus deck: *BOUNDARY of the model and of every step, along the directions of *TRANSFORM."""

from __future__ import annotations

from functools import partial

import numpy as np

from femflex.arrays import Array
from femflex.decks.abaqus.axes import System
from femflex.decks.abaqus.model import AbaqusModel, location_of, plain_name
from femflex.fem import Support
from femflex.fem.support import COMPONENTS
from femflex.mesh.formats.abaqus_flat import InstanceKeyword

SupportSet = dict[str, Support]
State = dict[int, set[int]]  # node -> components 0 to 5

NAMED_SUPPORTS = {
    "ENCASTRE": (0, 1, 2, 3, 4, 5), "PINNED": (0, 1, 2),
    "XSYMM": (0, 4, 5), "YSYMM": (1, 3, 5), "ZSYMM": (2, 3, 4),
    "XASYMM": (1, 2, 3), "YASYMM": (0, 2, 4), "ZASYMM": (0, 1, 5),
}  # fmt: skip


def read_supports(model: AbaqusModel, transforms: dict[int, System]) -> tuple[dict[str, SupportSet], tuple[str, ...]]:
    """Supports by name, "initial" and "step 1" ..., each with all supports active in that step; and the default set.

    The default is the first step with *FREQUENCY, otherwise step 1, otherwise "initial".
    """
    previous: State = {}
    state: State = {}  # of the current step, whose blocks add up
    states: dict[str, State] = {}
    step, active = 0, ""
    for entry in model.flat.keywords:
        name = entry.keyword.name
        if name == "STEP":
            states[_state_name(step)] = previous = _merge_states(previous, state)  # state before this step
            step, state = step + 1, {}
        elif name == "FREQUENCY" and step and not active:
            active = f"step {step}"
        elif name == "BOUNDARY":
            model.findings.use("*BOUNDARY")
            if entry.keyword.parameter("op").upper() == "NEW":
                previous = {}
            model.attempt(entry.keyword, partial(_boundary, model, entry, state))
    states[_state_name(step)] = _merge_states(previous, state)
    active = active if active in states else ("step 1" if "step 1" in states else "initial")
    sets = {name: _supports_of_state(model, state_of_step, name, transforms) for name, state_of_step in states.items()}
    return sets, (active,)


def _merge_states(a: State, b: State) -> State:
    return {node: a.get(node, set()) | b.get(node, set()) for node in (*a, *b)}


def _state_name(step: int) -> str:
    return f"step {step}" if step else "initial"


def _boundary(model: AbaqusModel, entry: InstanceKeyword, state: State) -> None:
    scope, keyword = entry
    kind = keyword.parameter("type").upper()
    if "submodel" in keyword.parameters or kind in ("VELOCITY", "ACCELERATION"):
        model.findings.unused(
            f"*BOUNDARY, {kind or 'SUBMODEL'}",
            "prescribed motion is left out; prescribe it in the case",
            location_of(keyword),
        )
        return
    for k, row in enumerate(keyword.data):
        if not row[0]:
            continue
        nodes = model.nodes_of(row[0], scope, keyword, k)
        words = row[1:]
        if words and words[0].upper() in NAMED_SUPPORTS:
            components: tuple[int, ...] = NAMED_SUPPORTS[words[0].upper()]
        else:
            if not words or not words[0]:
                raise keyword.error(f"names no component of {row[0]!r}; give 1 to 6.", k)
            first = keyword.integer(words[0], k, "a component")
            last = keyword.integer(words[1], k, "a component") if len(words) > 1 and words[1] else first
            components = tuple(c - 1 for c in range(first, last + 1) if 1 <= c <= 6)
            if not components:
                model.findings.unused(
                    "*BOUNDARY of other components", "temperatures and pressures are left out", location_of(keyword, k)
                )
                continue
            if len(words) > 2 and words[2] and keyword.real(words[2], k, "a displacement"):
                model.findings.unused(
                    "*BOUNDARY that is not zero", "the component is held at zero; prescribe motion in the case",
                    location_of(keyword, k),
                )  # fmt: skip
        for node in nodes:
            ref = model.rotation_nodes.get(node)
            if ref is not None:
                state.setdefault(model.representative(ref), set()).update(c + 3 for c in components if c < 3)
            else:
                state.setdefault(model.representative(node), set()).update(components)


def _supports_of_state(model: AbaqusModel, state: State, name: str, transforms: dict[int, System]) -> SupportSet:
    """Groups of nodes with the same components along the same axes."""
    fixed: State = {}
    for node, components in state.items():
        if node not in model.moving:
            continue
        fixed[node] = {c + 1 for c in components if c < 3 or node in model.turning}
        dependent = {c for c in fixed[node] if (node, c) in model.depending}
        if dependent:
            model.findings.note(
                f"{name}: components {sorted(dependent)} of node {model.flat.label(node)} are "
                f"supported, but depend on others by {model.depending[node, min(dependent)]}; this support is left "
                "out, so support the others"
            )
            fixed[node] -= dependent

    def axes(node: int) -> Array:
        return transforms[node].axes_at(model.x(node)) if node in transforms else np.eye(3)

    return model.support_set(fixed, axes, lambda c: plain_name(f"{name} {' '.join(COMPONENTS[k - 1] for k in c)}"))
