"""GENEL: elements given by a stiffness or flexibility matrix between components of grid points."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.model import NastranModel
from femflex.decks.nastran.springs import component_term
from femflex.fem import ScalarSpring

Pairs = list[tuple[int, int]]  # grid point and component 1 to 6

NEGLIGIBLE = 1e-10  # stiffness, relative to the largest eigenvalue (diagonal scaled to one), below which it is ignored
PART_NAMES = ("UD", "K", "Z", "S")


def read_general_elements(model: NastranModel) -> None:
    """Add the GENEL of a deck to the model, as springs on the eigenvectors of their matrices."""
    model.bulk.for_each_card(lambda card: _general(model, card), "GENEL")


def _general(model: NastranModel, card: Card) -> None:
    """Fields: EID, blank, pairs of grid and component of UI; UD and pairs; K or Z by its lower triangle; S by rows.

    The forces on UI are K (u_i - S u_d), K = Z^-1; those on UD are in equilibrium with them by S.
    """
    parts = _parts(card)
    independent, dependent = (_pairs(card, parts.get(name, [])) for name in ("UI", "UD"))
    grids = [grid for grid, _ in independent + dependent]
    if not independent:
        raise ValueError(f"{card} names no components UI")
    if not model.grids.require(grids, card):
        return
    unit = _units(model, independent)
    K = _stiffness(card, parts, len(independent)) * model.bulk.units.moment / np.outer(unit, unit)
    factors = np.eye(len(independent))
    if dependent:
        factors = np.hstack([factors, -_coupling(card, parts, model, independent, dependent)])
    scale = np.sqrt(np.maximum(np.diag(K), np.finfo(float).tiny))
    value, vectors = np.linalg.eigh(K / np.outer(scale, scale))
    if value[0] < -NEGLIGIBLE * value[-1]:
        raise ValueError(f"{card} has a stiffness matrix that is not positive semidefinite; correct its K or Z")
    turns = any(c > 3 for _, c in independent + dependent)
    for k in range(len(independent)):
        if value[k] <= NEGLIGIBLE * value[-1]:
            continue
        row = (vectors[:, k] * scale) @ factors
        terms = tuple(
            component_term(model, grid, component, float(f))
            for (grid, component), f in zip(independent + dependent, row, strict=True)
            if f
        )
        model.springs.append((ScalarSpring(terms, float(value[k])), grids, turns, card))
    model.required.update(grids)
    model.required_turning.update(grid for grid, c in independent + dependent if c > 3)


def _parts(card: Card) -> dict[str, list[str]]:
    """Fields of each part of the card by its name; UI comes first, with pairs from the third field on."""
    parts: dict[str, list[str]] = {"UI": []}
    name = "UI"
    for k, word in enumerate(card.fields[2:], 2):
        text = word.strip().upper()
        if text in PART_NAMES:
            name = text
            if name in parts:
                raise ValueError(f"{card} has {name} twice")
            parts[name] = []
        else:
            if name in ("K", "Z", "S"):
                card.real(k, 0.0)  # raises where it is no number
            parts[name].append(text)
    return parts


def _pairs(card: Card, words: list[str]) -> Pairs:
    numbers = [word for word in words if word]
    if len(numbers) % 2 or not all(word.isdigit() for word in numbers):
        raise ValueError(f"{card} has {' '.join(numbers)} where pairs of a grid point and a component are needed")
    pairs = [(int(g), int(c)) for g, c in zip(numbers[::2], numbers[1::2], strict=True)]
    invalid = [c for _, c in pairs if not 1 <= c <= 6]
    if invalid:
        raise ValueError(f"{card} has component {invalid[0]}; components of grid points are 1 to 6")
    return pairs


def _part_values(card: Card, words: list[str], count: int, what: str) -> list[float]:
    """The values of a part, blank ones zero; raises ValueError if their number is wrong."""
    filled = max((k + 1 for k, word in enumerate(words) if word), default=0)
    if filled > count or len(words) < count:
        raise ValueError(f"{card} has {filled} values of {what}; {count} are needed")
    return Card(card.name, words, card.location).reals(0, count)


def _units(model: NastranModel, pairs: Pairs) -> Array:
    """Metres (or radians) per unit of each component."""
    return np.array([model.bulk.units.length if c < 4 else 1.0 for _, c in pairs])


def _stiffness(card: Card, parts: dict[str, list[str]], n: int) -> Array:
    """K (n, n) in the units of the deck."""
    names = [name for name in ("K", "Z") if name in parts]
    if len(names) != 1:
        raise ValueError(f"{card} has {' and '.join(names) or 'neither K nor Z'}; give one of K and Z")
    matrix: Array = np.zeros((n, n))
    what = f"{names[0]} (the lower triangle by columns, {n} components UI)"
    matrix.T[np.triu_indices(n)] = _part_values(card, parts[names[0]], n * (n + 1) // 2, what)
    matrix = matrix + np.tril(matrix, -1).T
    if names[0] == "Z":
        try:
            np.linalg.cholesky(matrix)
        except np.linalg.LinAlgError:
            raise ValueError(f"{card} has a flexibility matrix Z that is not positive definite; correct it") from None
        return np.asarray(np.linalg.inv(matrix))
    return matrix


def _coupling(
    card: Card,
    parts: dict[str, list[str]],
    model: NastranModel,
    independent: Pairs,
    dependent: Pairs,
) -> Array:
    """S (n_i, n_d) in SI from the card; without S, that of a rigid motion determined by the six components UD."""
    shape = (len(independent), len(dependent))
    if "S" not in parts:
        return _rigid_coupling(card, model, independent, dependent)
    values = _part_values(card, parts["S"], shape[0] * shape[1], f"S ({shape[0]} components UI by {shape[1]} UD)")
    return np.array(values).reshape(shape) * _units(model, independent)[:, None] / _units(model, dependent)


def _rigid_coupling(card: Card, model: NastranModel, independent: Pairs, dependent: Pairs) -> Array:
    """Motion of UI under the rigid motions of UD."""

    def motions(pairs: Pairs) -> Array:
        rows = []
        for grid, c in pairs:
            axis = model.grids.axes(grid)[(c - 1) % 3]
            lever = np.cross(model.grids[grid].position, axis)
            rows.append(np.concatenate([axis, lever] if c < 4 else [np.zeros(3), axis]))
        return np.array(rows)

    dependent_motions = motions(dependent)
    S = motions(independent) @ np.linalg.pinv(dependent_motions)
    if np.abs(S @ dependent_motions - motions(independent)).max() > 1e-6 * max(
        1.0, float(np.abs(dependent_motions).max())
    ):
        raise ValueError(f"{card} has no S, and its components UD do not determine the rigid motions of UI; give S")
    return np.asarray(S)
