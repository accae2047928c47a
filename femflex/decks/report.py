"""Text that describes a deck: units, mass, extent, used cards, and unused cards with their consequence."""

from __future__ import annotations

import warnings

import numpy as np

from femflex.arrays import Array
from femflex.decks.deck import Deck
from femflex.decks.units import implausible
from femflex.fem import Structure
from femflex.fem.static_loads import StaticLoads
from femflex.warning import grouped_texts

NO_MASS = 1e-6  # [kg] below which a deck without densities has no mass


def mass_and_centre(structure: Structure) -> tuple[float, Array]:
    """Mass [kg] and centre of mass (3,) [m] of a structure, in the deck's basic coordinates."""
    mass, first = 0.0, np.zeros(3)
    for block in structure.inertia:
        dm = np.broadcast_to(block.dm, block.rho.shape[:-1])
        mass += float(dm.sum())
        first += np.einsum("eq,eqi->i", dm, block.rho)
    return mass, first / mass if mass > 0 else first


def without_mass(deck: Deck, structure: Structure) -> bool:
    """Whether the deck has no mass: no density and no point masses (massless bars have a negligible mass)."""
    return mass_and_centre(structure)[0] < NO_MASS and not any(rho > 0 for rho in deck.densities)


def doubts(deck: Deck, structure: Structure) -> list[str]:
    """Sentences on mass, size and materials that are implausible in the declared units."""
    E, rho = list(deck.moduli), list(deck.densities)
    mass, _ = mass_and_centre(structure)
    extent = float(np.ptp(deck.mesh.points, axis=0).max()) if len(deck.mesh.points) else 0.0
    return implausible(deck.units, E, rho, extent, mass)


def describe(deck: Deck) -> str:
    """Readable text of several lines about a deck."""
    u = deck.units
    lines = [
        f"{deck.name}: {deck.solver} deck, read in {u.name} (1 = {u.length:.6g} m, {u.mass:.6g} kg, {u.time:.6g} s)"
    ]
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            structure = deck.structure()
        mass, centre = mass_and_centre(structure)
        low, high = deck.mesh.points.min(axis=0), deck.mesh.points.max(axis=0)
        lines += [
            f"mass      {mass:.6g} kg, centre {_list(centre)} m",
            f"extent    {_list(high - low)} m, from {_list(low)} to {_list(high)} m",
            f"dofs      {structure.n_dof} of {len(deck.mesh.points)} nodes, {len(deck.members)} members",
        ]
        lines += [f"note      {text}" for text in structure.notes]
        lines += [f"doubt     {text}" for text in doubts(deck, structure)]
        lines += [
            f"doubt     {text}"
            for text in grouped_texts([entry.message for entry in caught if isinstance(entry.message, Warning)])
        ]
    except ValueError as error:
        lines.append(f"stops     {error}")
    lines += [f"used      {', '.join(f'{count} {card}' for card, count in deck.used.items())}"]
    lines += [f"left out  {entry}" for entry in deck.unused]
    lines += [f"note      {text}" for text in deck.notes]
    force = ", ".join(deck.default_supports) or "none"
    sets = ", ".join(sorted(deck.supports)) or "none"
    lines.append(f"supports  in force: {force}; sets: {sets}")
    lines += [f"loads     {name}: {_loads_text(loads, deck.mesh.points)}" for name, loads in deck.loads.items()]
    names = [name for name in deck.mesh.groups if name.startswith(("pid_", "set_")) or not name.startswith("node_")]
    listed_names = [
        name
        for name in names
        if "-part" not in name
        and not name.startswith(("spc_", "ps-", "lone_nodes"))
        and name not in deck.supports
        and "autospc" not in name
    ]
    more = f" and {len(listed_names) - 30} more" if len(listed_names) > 30 else ""
    lines.append(f"groups    {', '.join(listed_names[:30])}{more}")
    return "\n".join(lines)


def _loads_text(loads: StaticLoads, points: Array) -> str:
    """The resultant of a set of loads, and its force per mass."""
    force, moment = loads.resultant(points)
    texts = [f"force {_list(force)} N, moment about the origin {_list(moment)} N m"] if len(loads.points) else []
    texts += [f"force per mass {_list(loads.acceleration)} m/s^2"] if loads.acceleration.any() else []
    return "; ".join(texts)


def _list(values: Array) -> str:
    return "(" + ", ".join(f"{v + 0.0:.6g}" for v in np.round(values, 12)) + ")"
