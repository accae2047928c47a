"""Drawing of a deploying member: the deployed part, which grows, and the coil of the stowed part at the drum."""

from __future__ import annotations

import numpy as np

from femflex.arrays import IntArray
from femflex.body import Skin
from femflex.deployment.series import Series, derivative, evaluate
from femflex.deployment.shapes import MemberShapes, quadrilateral_grid

SIDES = 16  # of the coil
LEAST = 0.3  # radius of an empty drum over that of a full one
COIL = 0.02  # radius of a full drum over the stock, where it is not given
LARGEST = 1.0  # m; largest radius of such a drum


def deployed_skin(shapes: MemberShapes, length: float, stock: float, at_tip: bool, radius: float | None) -> Skin:
    """The skin at a length, with its growth; radius: of the full drum [m], None: by the stock."""
    series, cells = shapes.drawn_series()
    coil, coil_cells = _coil(shapes, stock, at_tip, radius)
    first = len(next(iter(series.values())))
    kinds = sorted({*cells, *coil_cells})
    joined = {
        kind: np.concatenate(
            [part for part in (cells.get(kind), _shifted(coil_cells.get(kind), first)) if part is not None]
        )
        for kind in kinds
    }
    series_of_all: Series = {}
    powers = {*series, *coil}
    for p in powers:
        parts = [part[p] if p in part else np.zeros_like(next(iter(part.values()))) for part in (series, coil)]
        series_of_all[p] = np.concatenate(parts)
    ratio = length / shapes.reference
    values, rates = evaluate(series_of_all, ratio), evaluate(derivative(series_of_all), ratio) * ratio
    return Skin(values[:, :, 0], joined, np.ascontiguousarray(values[:, :, 1:].transpose(2, 0, 1)), rates[:, :, 0])


def _shifted(cells: IntArray | None, first: int) -> IntArray | None:
    return None if cells is None else cells + first


def _coil(shapes: MemberShapes, stock: float, at_tip: bool, radius: float | None) -> tuple[Series, dict[str, IntArray]]:
    """A drum across the member, behind the exit or ahead of the tip, whose radius falls with the stowed length."""
    full = radius or max(min(COIL * stock, LARGEST), 3.0 * shapes.thickness)
    width = shapes.half_width or full
    angle = np.arange(SIDES) * 2 * np.pi / SIDES
    turn = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    per_length = (1.0 - LEAST) * full / stock * shapes.reference  # loss of radius per lambda
    rim = np.repeat(turn[None], 2, axis=0)
    side = np.array([-width, width])[:, None, None] * np.array([0.0, 1.0, 0.0])
    centre = np.array([1.0 if at_tip else -1.0, 0.0, 0.0]) * full
    points = (full * rim + side + centre).reshape(-1, 3)
    shrink = (-per_length * rim).reshape(-1, 3)
    marker = shapes.marker(1.0 if at_tip else 0.0)
    count, n = len(points), shapes.n_shapes
    out: Series = {}
    for p in {0, 1, *marker.position}:
        part = np.zeros((count, 3, 1 + n))
        if p in marker.position:
            part[:, :, 0] += marker.position[p]
            part[:, :, 1:] += marker.phi[p]
        local = points if p == 0 else shrink if p == 1 else np.zeros_like(points)
        part[:, :, 0] += local @ shapes.axes.frame
        out[p] = part
    return out, {"quad": quadrilateral_grid(2, SIDES, closed=True)}
