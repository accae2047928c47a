"""Tables of a starting case for a body from a deck: units, clamp, markers and a comment of the deck's groups."""

from __future__ import annotations

import json
import math
import textwrap
from dataclasses import dataclass

GROUPS_SHOWN = 24  # names of groups that the comment lists


@dataclass(frozen=True)
class DeckFacts:
    """Facts of a deck that a starting case needs.

    file         path from the case
    solver       "Nastran", "Abaqus"
    units        that the deck is taken to be in, and units_reason why
    supports     names of its sets of supports; clamp: that which holds the body, "" where it is free
    root, tip    numbers of a node at the clamp (or next to the centre of mass) and of the node farthest from it
    groups       names that a case can use
    mass, extent [kg], [m];  frequencies [Hz] of its modes, () where there are none
    materials    names by which overrides name its materials, as keys of TOML
    weightless   names of a deck without mass, and the key of their override: density or nonstructural_mass
    rigid        whether it has no elastic modes
    notes        sentences on what needs to be looked at
    loads        names of its sets of loads
    """

    file: str
    solver: str
    units: str
    units_reason: str
    supports: tuple[str, ...]
    clamp: str
    root: int
    tip: int
    groups: tuple[str, ...]
    mass: float
    extent: float
    frequencies: tuple[float, ...] = ()
    materials: tuple[str, ...] = ()
    weightless: tuple[tuple[str, str], ...] = ()
    rigid: bool = False
    notes: tuple[str, ...] = ()
    loads: tuple[str, ...] = ()


def deck_tables(facts: DeckFacts) -> str:
    """Tables of the body "flexible" and of the joint that welds it to the hub."""
    reduction = f'method = "cantilever", clamp = {json.dumps(facts.clamp)}' if facts.clamp else 'method = "free_free"'
    reduction += f", modes = {min(6, len(facts.frequencies)) or 6}"
    if facts.rigid:
        reduction = 'method = "rigid"'
    values = {"density": "2700 kg/m^3", "nonstructural_mass": "5.4 kg/m^2"}
    overrides = ", ".join(f'{name} = {{ {key} = "{values[key]}" }}' for name, key in facts.weightless)
    lines = [
        "",
        *_comment(
            f"Groups of the deck: {_names_text(facts.groups)}. A node is node_17, a property pid_3, by its number."
        ),
        *_comment(f"Sets of supports: {_names_text(facts.supports)}. A clamp may name one, a group, or several."),
        "[bodies.flexible]",
        'kind = "flexible"',
        f"deck = {json.dumps(facts.file)}",
        f"units = {json.dumps(facts.units)}{' ' * 11}# {facts.units_reason}",
        *(
            [f"overrides = {{ {overrides} }}    # the deck has no mass: a guess"]
            if overrides
            else [f'# overrides = {{ {name} = {{ density = "2700 kg/m^3" }} }}' for name in facts.materials[:1]]
        ),
        f"reduction = {{ {reduction} }}",
        "damping = { ratio = 0.005 }     # of critical damping",
        "",
        "[bodies.flexible.markers.root]",
        f'group = "node_{facts.root}"',
    ]
    if facts.tip != facts.root:
        lines += ["", "[bodies.flexible.markers.tip]", f'group = "node_{facts.tip}"     # the farthest from the root']
    lines += [
        "",
        f"[[joints]]                 # welded to the hub {'where it is clamped' if facts.clamp else 'at its middle'}",
        'kind = "weld"',
        'parent = "hub"',
        'parent_marker = "side"',
        'child = "flexible"',
        'child_marker = "root"',
        "",
    ]
    if facts.loads:
        lines += [
            *_comment(f"Sets of loads: {_names_text(facts.loads)}. They act if a table names them:"),
            "# [distributed_loads.static]",
            '# body = "flexible"',
            f"# load_set = {json.dumps(facts.loads[0])}",
            "# level = 1               # a factor, or a signal",
            "",
        ]
    return "\n".join(lines)


def suitable_scale(facts: DeckFacts) -> dict[str, str]:
    """Duration, output step, hub and torque that suit a body of this mass, extent and first frequency."""
    mass, side = _rounded(10 * facts.mass or 1.0), _rounded(facts.extent / 3 or 1.0)
    lowest = next((f for f in facts.frequencies if f > 0), 0.0)
    duration = _rounded(20 / lowest) if lowest else 60.0
    step = _rounded(min(duration / 400, 0.1 / facts.frequencies[-1])) if lowest else 0.05
    inertia = _rounded(mass * side**2 / 6)
    torque = _rounded((inertia + facts.mass * facts.extent**2) * 0.1 / (duration / 6) ** 2)
    return {
        "duration": f"{duration:g} s", "step": f"{max(step, duration / 20000):g} s", "mass": f"{mass:g} kg",
        "inertia": f"{inertia:g} kg m^2", "size": f"{side:g} m", "half": f"{side / 2:g} m", "torque": f"{torque:g}",
        "middle": f"{duration / 6:.6g} s", "end": f"{duration / 3:.6g} s",
    }  # fmt: skip


def _rounded(value: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is at most a positive number."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f"{max(step * power for step in (1, 2, 5) if step * power <= value * (1 + 1e-12)):.0e}")


def _names_text(names: tuple[str, ...]) -> str:
    rest_text = f" and {len(names) - GROUPS_SHOWN} more" if len(names) > GROUPS_SHOWN else ""
    return (", ".join(names[:GROUPS_SHOWN]) or "none") + rest_text


def _comment(text: str) -> list[str]:
    return [f"# {line}" for line in textwrap.wrap(text, 110)]
