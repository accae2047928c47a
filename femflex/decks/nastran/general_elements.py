"""GENEL: elements given by a stiffness or flexibility matrix between components of grid points."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.decks.nastran.card import Card
from femflex.decks.nastran.model import NastranModel
from femflex.decks.nastran.springs import component_term
from femflex.fem import ScalarSpring

Pairs = list[tuple[int, int]]  # grid point and component 1 to 6

NEGLIGIBLE = 1e-10  # of the largest eigenvalue (diagonal scaled to one): a stiffness below it is none
WORDS = ("UD", "K", "Z", "S")


def read_general_elements(model: NastranModel) -> None:
    """Add the GENEL of a deck to the model, as springs on the eigenvectors of their matrices."""
    model.bulk.trying(lambda card: _general(model, card), "GENEL")


def _general(model: NastranModel, card: Card) -> None:
    """EID, blank, pairs of grid and component of UI; UD and pairs; K or Z by its lower triangle; S by rows.

    The forces on UI are K (u_i - S u_d), K = Z^-1; those on UD are in equilibrium with them by S.
    """
    parts = _parts(card)
    own, other = (_pairs(card, parts.get(name, [])) for name in ("UI", "UD"))
    grids = [grid for grid, _ in own + other]
    if not own:
        raise ValueError(f"{card} names no components UI")
    if any(g in model.grids.scalars for g in grids):
        model.bulk.found.unused("GENEL", "matrices to scalar points are left out", card.place)
        return
    if not model.grids.require(grids, card):
        return
    unit = _units(model, own)
    K = _stiffness(card, parts, len(own)) * model.bulk.units.moment / np.outer(unit, unit)
    factors = np.eye(len(own))
    if other:
        factors = np.hstack([factors, -_coupling(card, parts, model, own, other)])
    scale = np.sqrt(np.maximum(np.diag(K), np.finfo(float).tiny))
    value, vectors = np.linalg.eigh(K / np.outer(scale, scale))
    if value[0] < -NEGLIGIBLE * value[-1]:
        raise ValueError(f"{card} has a stiffness matrix that is not positive semidefinite; correct its K or Z")
    turns = any(c > 3 for _, c in own + other)
    for k in range(len(own)):
        if value[k] <= NEGLIGIBLE * value[-1]:
            continue
        row = (vectors[:, k] * scale) @ factors
        terms = tuple(
            component_term(model, grid, component, float(f))
            for (grid, component), f in zip(own + other, row, strict=True)
            if f
        )
        model.springs.append((ScalarSpring(terms, float(value[k])), grids, turns, card))
    model.wanted.update(grids)
    model.wanted_turning.update(grid for grid, c in own + other if c > 3)


def _parts(card: Card) -> dict[str, list[str]]:
    """Fields of each part of the card by its word; those of UI stand first, pairs from the third field on."""
    found: dict[str, list[str]] = {"UI": []}
    name = "UI"
    for k, word in enumerate(card.fields[2:], 2):
        text = word.strip().upper()
        if text in WORDS:
            name = text
            if name in found:
                raise ValueError(f"{card} has {name} twice")
            found[name] = []
        else:
            if name in ("K", "Z", "S"):
                card.real(k, 0.0)  # raises where it is no number
            found[name].append(text)
    return found


def _pairs(card: Card, words: list[str]) -> Pairs:
    numbers = [word for word in words if word]
    if len(numbers) % 2 or not all(word.isdigit() for word in numbers):
        raise ValueError(f"{card} has {' '.join(numbers)} where pairs of a grid point and a component are needed")
    pairs = [(int(g), int(c)) for g, c in zip(numbers[::2], numbers[1::2], strict=True)]
    wrong = [c for _, c in pairs if not 1 <= c <= 6]
    if wrong:
        raise ValueError(f"{card} has component {wrong[0]}; components of grid points are 1 to 6")
    return pairs


def _reals(card: Card, words: list[str], count: int, what: str) -> list[float]:
    """The values of a part, blank ones zero; raises ValueError where their number differs."""
    filled = max((k + 1 for k, word in enumerate(words) if word), default=0)
    if filled > count or len(words) < count:
        raise ValueError(f"{card} has {filled} values of {what}; {count} are needed")
    return Card(card.name, words, card.place).reals(0, count)


def _units(model: NastranModel, pairs: Pairs) -> Array:
    """Metres (or radians) per unit of each component."""
    return np.array([model.bulk.units.length if c < 4 else 1.0 for _, c in pairs])


def _stiffness(card: Card, parts: dict[str, list[str]], n: int) -> Array:
    """K (n, n) in the units of the deck."""
    given = [name for name in ("K", "Z") if name in parts]
    if len(given) != 1:
        raise ValueError(f"{card} has {' and '.join(given) or 'neither K nor Z'}; give one of K and Z")
    matrix: Array = np.zeros((n, n))
    what = f"{given[0]} (the lower triangle by columns, {n} components UI)"
    matrix.T[np.triu_indices(n)] = _reals(card, parts[given[0]], n * (n + 1) // 2, what)
    matrix = matrix + np.tril(matrix, -1).T
    if given[0] == "Z":
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
    own: Pairs,
    other: Pairs,
) -> Array:
    """S (n_i, n_d) in SI, as given; that of rigid motion of the six components UD where it is left out."""
    shape = (len(own), len(other))
    if "S" not in parts:
        return _rigid(card, model, own, other)
    values = _reals(card, parts["S"], shape[0] * shape[1], f"S ({shape[0]} components UI by {shape[1]} UD)")
    return np.array(values).reshape(shape) * _units(model, own)[:, None] / _units(model, other)


def _rigid(card: Card, model: NastranModel, own: Pairs, other: Pairs) -> Array:
    """Motion of UI by the rigid motions that UD have."""

    def motions(pairs: Pairs) -> Array:
        rows = []
        for grid, c in pairs:
            axis = model.grids.axes(grid)[(c - 1) % 3]
            lever = np.cross(model.grids[grid].position, axis)
            rows.append(np.concatenate([axis, lever] if c < 4 else [np.zeros(3), axis]))
        return np.array(rows)

    by = motions(other)
    S = motions(own) @ np.linalg.pinv(by)
    if np.abs(S @ by - motions(own)).max() > 1e-6 * max(1.0, float(np.abs(by).max())):
        raise ValueError(f"{card} has no S, and its components UD do not determine the rigid motions of UI; give S")
    return np.asarray(S)
