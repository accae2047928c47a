"""Assumed strains of shell elements: polynomials through the elements' own strains at the points of the literature."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.fem.shell.tying import products
from femflex.mesh.cells import CELL_TYPES

TRIANGLE = np.array([[0.13, 0.2], [0.4, 0.35], [0.7, 0.1], [0.25, 0.6], [1 / 3, 1 / 3]])
SQUARE = np.array([[0.13, 0.2], [0.8, 0.35], [0.7, 0.9], [0.25, 0.6], [0.0, 1.0]])
ROOT3, ROOT15 = 1 / np.sqrt(12), np.sqrt(3 / 5) / 2  # Gauss points from the middle of [0, 1]
A, B = 0.5 - ROOT3, 0.5 + ROOT3
C = np.array([0.5 - ROOT15, 0.5, 0.5 + ROOT15])


def own(cell, at, what):
    """(q, k, k) of one strain at points: rr, ss, 2 rs of places m and displacements k; rt, st of slopes or turns."""
    h, dh = CELL_TYPES[cell].interpolation(np.array(at)), CELL_TYPES[cell].gradients(np.array(at))
    r, s = dh[:, :, 0], dh[:, :, 1]
    both = {"rr": (r, r), "ss": (s, s), "rt": (r, h), "st": (s, h), "tr": (h, r), "ts": (h, s)}
    if what in both:
        a, b = both[what]
        return np.einsum("qk,qm->qkm", a, b)
    return np.einsum("qk,qm->qkm", r, s) + np.einsum("qk,qm->qkm", s, r)


def through(points, at, values, degrees):
    """The polynomial of these powers of r and s through values (t, ...) at points (t, 2), at other points."""
    powers = [np.stack([p[:, 0] ** i * p[:, 1] ** j for i, j in degrees], axis=1) for p in (points, np.array(at))]
    return np.tensordot(powers[0] @ np.linalg.inv(powers[1]), values, axes=1)


def test_four_nodes_sample_transverse_shear_in_the_middle_of_their_sides():
    """Dvorkin and Bathe (1984); strains in the layer are the element's own."""
    found = products("quad", SQUARE)
    ends, sides = [(0.5, 0.0), (0.5, 1.0)], [(0.0, 0.5), (1.0, 0.5)]
    for table, names in ((found.slope, ("rt", "st")), (found.turn, ("tr", "ts"))):
        for row, at, degrees in ((0, ends, [(0, 0), (0, 1)]), (1, sides, [(0, 0), (1, 0)])):
            wanted = through(SQUARE, at, own("quad", at, names[row]), degrees)
            assert table[:, row] == pytest.approx(wanted, abs=1e-12)
    for row, what in enumerate(("rr", "ss", "2rs")):
        assert found.inlayer[:, row] == pytest.approx(own("quad", SQUARE, what), abs=1e-12)
        assert found.untied[:, row] == pytest.approx(own("quad", SQUARE, what), abs=1e-12)


def test_nine_nodes_sample_at_two_by_three_points_and_their_shear_in_the_layer_at_two_by_two():
    """Bucalem and Bathe (1993): linear along the strain, quadratic across it."""
    found = products("quad9", SQUARE)
    along = [(r, s) for r in (A, B) for s in C]
    across = [(s, r) for r, s in along]
    four = [(r, s) for r in (A, B) for s in (A, B)]
    first, second = [(i, j) for i in (0, 1) for j in (0, 1, 2)], [(j, i) for i in (0, 1) for j in (0, 1, 2)]
    bilinear = [(0, 0), (0, 1), (1, 0), (1, 1)]
    for table, row, what, at, degrees in (
        (found.inlayer, 0, "rr", along, first), (found.inlayer, 1, "ss", across, second),
        (found.inlayer, 2, "2rs", four, bilinear),
        (found.slope, 0, "rt", along, first), (found.slope, 1, "st", across, second),
        (found.turn, 0, "tr", along, first), (found.turn, 1, "ts", across, second),
    ):  # fmt: skip
        assert table[:, row] == pytest.approx(through(SQUARE, at, own("quad9", at, what), degrees), abs=1e-11)
    assert found.untied[:, 2] == pytest.approx(own("quad9", SQUARE, "2rs"), abs=1e-12)


def test_three_nodes_have_constant_shear_along_their_sides():
    """Lee and Bathe (2004): the component along each side is the one in its middle, all along the side."""
    t = np.array([0.1, 0.5, 0.8])
    for name, kinds in (("slope", ("rt", "st")), ("turn", ("tr", "ts"))):
        for side, way in (
            (np.stack([t, 0 * t], axis=1), (1, 0)), (np.stack([0 * t, t], axis=1), (0, 1)),
            (np.stack([t, 1 - t], axis=1), (1, -1)),
        ):  # fmt: skip
            middle = side.mean(axis=0) * 0 + np.where(np.ptp(side, axis=0) > 0, 0.5, side[0])
            table = getattr(products("triangle", side), name)
            wanted = sum(w * own("triangle", [middle], kind) for w, kind in zip(way, kinds, strict=True))
            assert way[0] * table[:, 0] + way[1] * table[:, 1] == pytest.approx(np.repeat(wanted, 3, axis=0), abs=1e-12)


def test_six_nodes_sample_each_direction_at_three_points_and_shear_at_seven():
    """Lee and Bathe (2004): rr, ss and that along the third side are linear; two shears a side, both in the middle."""
    found, corner = products("triangle6", TRIANGLE), 1 / np.sqrt(3)
    linear = [(0, 0), (1, 0), (0, 1)]
    first, second = [(A, 0), (B, 0), (A, corner)], [(0, A), (0, B), (corner, A)]
    rr = through(TRIANGLE, first, own("triangle6", first, "rr"), linear)
    ss = through(TRIANGLE, second, own("triangle6", second, "ss"), linear)
    third = [(B, A), (A, B), (A, A)]
    along = own("triangle6", third, "rr") + own("triangle6", third, "ss") - own("triangle6", third, "2rs")
    for row, wanted in enumerate((rr, ss, rr + ss - through(TRIANGLE, third, along, linear))):
        assert found.inlayer[:, row] == pytest.approx(wanted, abs=1e-11)
    sides = (([(A, 0), (B, 0)], (1, 0)), ([(0, A), (0, B)], (0, 1)), ([(B, A), (A, B)], (-1, 1)))
    for name, kinds in (("slope", ("rt", "st")), ("turn", ("tr", "ts"))):
        for at, way in (*sides, ([(1 / 3, 1 / 3)], (1, 0)), ([(1 / 3, 1 / 3)], (0, 1))):
            table = getattr(products("triangle6", np.array(at)), name)
            wanted = sum(w * own("triangle6", at, kind) for w, kind in zip(way, kinds, strict=True))
            assert way[0] * table[:, 0] + way[1] * table[:, 1] == pytest.approx(wanted, abs=1e-11)
        # rt = a1 + a2 r + a3 s + s (c r + d s), st = b1 + b2 r + b3 s - r (c r + d s)
        x = np.random.default_rng(4).random((30, 2)) / 2
        table = getattr(products("triangle6", x), name).reshape(30, 2, -1)
        r, s = x.T
        o, one = 0 * r, 0 * r + 1
        upper = np.stack([one, r, s, o, o, o, r * s, s * s], axis=1)
        lower = np.stack([o, o, o, one, r, s, -r * r, -r * s], axis=1)
        field, values = np.concatenate([upper, lower]), np.concatenate([table[:, 0], table[:, 1]])
        assert np.abs(field @ np.linalg.lstsq(field, values, rcond=None)[0] - values).max() < 1e-11
