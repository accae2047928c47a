"""Facts of a deck for its starting case: units, mass, supports, the nodes to attach it by, and frequencies."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from femflex.arrays import Array
from femflex.decks import Deck, read_deck
from femflex.decks.deck import AUTOSPC
from femflex.decks.findings import toml_key
from femflex.decks.report import mass_and_centre, without_mass
from femflex.decks.units import Units, likely_units, units_of
from femflex.fem import Structure, Support
from femflex.fem.support import COMPONENTS
from femflex.reduction import cantilever_modes, free_free_modes
from femflex.reduction.boundary.rigid import is_held_by_springs, rigid_shapes
from femflex.starting.case_text import CLAMPS, group_named_like
from femflex.starting.deck_text import DeckFacts

LARGEST = 60000  # degrees of freedom; modes of larger decks are not computed for their starting cases
MODES = 6
GUESSED_DENSITY, GUESSED_MASS = 2700.0, 5.4  # kg/m^3, kg/m^2: aluminium, 2 mm of it
RANK = 1e-8  # smallest singular value of the restrained motions, below which a rigid-body motion is free


def deck_facts(path: Path, units: str | None, file: str) -> DeckFacts:
    """The facts of a deck.

    path, file: of the deck, and as the case names it; units: None selects the likely ones

    Raises ValueError (DeckError) where the deck cannot be used.
    """
    notes = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # `check` and `run` print them for the case
        deck = read_deck(path, units or "m-kg-s")
        if units is None:
            units, reason = _likely_units(deck)
            notes.append(f"units: {units} is {reason}; state the deck's own with --units")
            deck = read_deck(path, units) if units != deck.units.name else deck
        else:
            reason = "as stated"
        structure = deck.structure()
        mass, centre = mass_and_centre(structure)
        weightless: tuple[tuple[str, str], ...] = ()
        if without_mass(deck, structure):
            if not deck.weightless:
                raise ValueError(f"{deck.name}: {deck.no_density}")
            weightless = tuple((toml_key(name), key) for name, key in deck.weightless)
            listed = ", ".join(f"{key} of {name}" for name, key in weightless[:6])
            notes.append(f"overrides: the deck has no mass; what is given is a guess: {listed}")
            guesses = {"density": GUESSED_DENSITY, "nonstructural_mass": GUESSED_MASS}
            deck = read_deck(path, units, {name: {key: guesses[key]} for name, key in deck.weightless})
            structure = deck.structure()
            mass, centre = mass_and_centre(structure)
    sets = tuple(name for name in deck.supports if name != AUTOSPC)
    clamp, supports = _clamp(deck, sets)
    if not clamp:
        none_restrain = (
            f"none of its sets of supports ({', '.join(sets)}) restrains" if sets else "no supports restrain"
        )
        group = group_named_like(list(_groups(deck)), CLAMPS)
        hint = f'; to clamp group {group!r}: reduction = {{ method = "cantilever", clamp = "{group}", modes = 6 }}'
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            shapes = rigid_shapes(structure)
            grounded = is_held_by_springs(structure.K, structure.M, shapes)
        reason_text = "its springs to ground hold it" if grounded else f"its modes are free-free{hint if group else ''}"
        notes.append(f"reduction: {none_restrain} all rigid-body motions of the deck; {reason_text}")
    root, tip = _ends(deck, supports, centre)
    frequencies, rigid = tuple[float, ...](), False
    if structure.n_dof > LARGEST:
        notes.append(f"run: duration and torque are guesses ({structure.n_dof} degrees of freedom, modes not computed)")
    elif mass > 0:
        try:
            frequencies = _frequencies(deck, clamp, supports)
            rigid = not frequencies
        except ValueError as error:  # `check` would refuse the case
            raise ValueError(f"{deck.name}: no body can be made of this deck: {' '.join(str(error).split())}") from None
    extent = float(np.ptp(deck.mesh.points, axis=0).max())
    notes += [f"left out: {cards}" for cards in deck.unused]
    return DeckFacts(
        file, deck.solver, units, reason, sets, clamp, root, tip, _groups(deck), mass, extent, frequencies,
        tuple(toml_key(name) for name in deck.materials), weightless, rigid, tuple(notes), tuple(deck.loads),
    )  # fmt: skip


def _likely_units(deck: Deck) -> tuple[str, str]:
    u: Units = units_of(deck.units)
    extent = float(np.ptp(deck.mesh.points, axis=0).max()) if len(deck.mesh.points) else 0.0
    return likely_units(
        [E / u.pressure for E in deck.moduli], [rho / u.density for rho in deck.densities], extent / u.length
    )


def _clamp(deck: Deck, sets: tuple[str, ...]) -> tuple[str, dict[str, Support]]:
    """The supports in force, or the first set, that prevent all rigid-body motions; "" where none does.

    Supports are first assessed alone: a deck held only by springs to ground or by AUTOSPC may be meant to be free.
    """
    if any(name != AUTOSPC for name in deck.default_supports) and removes_rigid_motion(
        deck, supports := deck.active_supports()
    ):
        return "supports", supports
    for name in sets:
        if removes_rigid_motion(deck, supports := {**deck.active_supports([name]), **supports_of_autospc(deck)}):
            return name, supports
    if deck.default_supports and is_supported(deck):
        return "supports", deck.active_supports()
    return "", supports_of_autospc(deck)


def is_supported(deck: Deck) -> bool:
    """Whether the supports in force, with springs to ground and AUTOSPC, leave the deck no rigid-body motion."""
    supports = deck.active_supports()
    structure = deck.structure(supports)
    if structure.n_dof > LARGEST or not structure.M.diagonal().any():
        return False
    try:
        cantilever_modes(structure, supports, 1)
    except ValueError:
        return False
    return True


def supports_of_autospc(deck: Deck) -> dict[str, Support]:
    """The supports of components without stiffness, by AUTOSPC; none where the deck does not ask for them."""
    return deck.active_supports([AUTOSPC]) if AUTOSPC in deck.supports else {}


def removes_rigid_motion(deck: Deck, supports: dict[str, Support]) -> bool:
    """Whether supports prevent all six rigid-body motions of the deck's nodes."""
    rows, points = [], deck.mesh.points
    centre, size = points.mean(axis=0), max(float(np.ptp(points, axis=0).max()), 1e-300)
    for group, support in supports.items():
        if group.startswith(AUTOSPC):
            continue
        axes = np.asarray(support.axes)
        x = (points[deck.mesh.group_points(group)] - centre) / size
        for k, component in enumerate(COMPONENTS):
            if component not in support.components:
                continue
            axis = np.broadcast_to(axes[k % 3], x.shape)
            moves = np.concatenate([axis, np.cross(x, axis)], axis=1)
            rows.append(moves if k < 3 else np.concatenate([np.zeros_like(x), axis], axis=1))
    if not rows:
        return False
    R = np.concatenate(rows)
    return bool(np.linalg.eigvalsh(R.T @ R)[0] > RANK)


def _ends(deck: Deck, supports: dict[str, Support], centre: Array) -> tuple[int, int]:
    """Numbers of two nodes: the nearest to the middle of the supported ones, and the farthest from it.

    Of a deck without supports the first is the nearest to the centre of mass.
    """
    numbers = np.array(sorted(deck.points_of_ids))
    x = deck.mesh.points[[deck.points_of_ids[int(n)] for n in numbers]]
    rows = [deck.mesh.group_points(group) for group in supports if not group.startswith(AUTOSPC)]
    fixed = np.unique(np.concatenate(rows)) if rows else np.zeros(0, np.int64)
    is_supported_node = np.isin([deck.points_of_ids[int(n)] for n in numbers], fixed)
    middle = x[is_supported_node].mean(axis=0) if is_supported_node.any() else centre
    away = np.linalg.norm(x - middle, axis=1)
    root = (
        int(np.argmin(np.where(is_supported_node, away, np.inf))) if is_supported_node.any() else int(np.argmin(away))
    )
    return int(numbers[root]), int(numbers[np.argmax(np.linalg.norm(x - x[root], axis=1))])


def _frequencies(deck: Deck, clamp: str, supports: dict[str, Support]) -> tuple[float, ...]:
    """Natural frequencies [Hz] of the lowest modes; fewer where the body has fewer."""
    structure: Structure = deck.structure(supports)
    for n in (MODES, 3, 1):
        try:
            modes = cantilever_modes(structure, supports, n) if clamp else free_free_modes(structure, n)
            return tuple(float(omega) / (2 * np.pi) for omega in modes.omega[:n])
        except ValueError as error:
            if "modes were requested" not in str(error):
                raise
    return ()  # a rigid body


def _groups(deck: Deck) -> tuple[str, ...]:
    """Names of groups that a case can use: the properties and sets of the deck."""
    support_groups = {group for supports in deck.supports.values() for group in supports}
    hidden = ("node_", "lone_nodes")
    return tuple(
        name
        for name in deck.mesh.groups
        if "-part" not in name and not name.startswith(hidden) and name not in support_groups
    )
