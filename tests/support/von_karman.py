"""A rectangular plate bent by several thicknesses, by Ritz's method on von Karman's energy with polynomials.

On x, y in (-1, 1) of half sides a and b, symmetric about both axes:

    e = sym(grad u) + 1/2 grad w grad w^T,    V = h/2 int e:C:e + h^3/24 int k:C:k,    k = -grad grad w.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Legendre, Polynomial


@dataclass(frozen=True)
class Plate:
    """Half sides a and b, thickness h [m], E [Pa], nu; whether its edges are clamped, and how they may draw in.

    edges: "held" in the plane; "immovable", held across and free along themselves; "straight", which move across as
    one, and are free along themselves; "free".
    """

    a: float
    b: float
    h: float
    E: float
    nu: float
    clamped: bool
    edges: str
    terms: int = 6

    def centres(self, pressures):
        """Deflections of the middle [m] under each pressure [Pa], by Newton's steps from one to the next."""
        w_terms, u_terms, v_terms = self._terms()
        bends = [_products(w_terms, dx, dy) / self.a**dx / self.b**dy for dx, dy in ((2, 0), (0, 2), (1, 1))]
        slopes = [_products(w_terms, dx, dy) / self.a**dx / self.b**dy for dx, dy in ((1, 0), (0, 1))]
        in_plane = [_products(terms, dx, dy) / self.a**dx / self.b**dy
                    for terms in (u_terms, v_terms) for dx, dy in ((1, 0), (0, 1))]  # fmt: skip
        C = self.E / (1 - self.nu**2) * np.array([[1, self.nu, 0], [self.nu, 1, 0], [0, 0, (1 - self.nu) / 2]])
        dA = np.outer(WEIGHTS, WEIGHTS).ravel() * self.a * self.b
        zero = np.zeros_like(in_plane[0])
        B = np.stack([
            np.column_stack([in_plane[0], zero]), np.column_stack([zero, in_plane[3]]),
            np.column_stack([in_plane[1], in_plane[2]]),
        ])  # fmt: skip
        k = np.stack([bends[0], bends[1], 2 * bends[2]])
        K_bend = self.h**3 / 12 * np.einsum("ipm,ij,jpn,p->mn", k, C, k, dA, optimize=True)
        load = dA @ _products(w_terms, 0, 0)
        middle = np.array([x(0.0) * y(0.0) for x, y in w_terms])
        n, q, found = len(w_terms), np.zeros(len(w_terms) + B.shape[2]), []
        for pressure in pressures:
            for _ in range(50):
                wx, wy = slopes[0] @ q[:n], slopes[1] @ q[:n]
                strain = np.einsum("ipm,m->ip", B, q[n:]) + np.stack([wx**2 / 2, wy**2 / 2, wx * wy])
                N = self.h * C @ strain
                G = np.stack([wx[:, None] * slopes[0], wy[:, None] * slopes[1],
                              wx[:, None] * slopes[1] + wy[:, None] * slopes[0]])  # fmt: skip
                every = np.concatenate([G, B], axis=2)
                K = self.h * np.einsum("ipm,ij,jpn,p->mn", every, C, every, dA, optimize=True)
                geometric = sum(
                    np.einsum("pm,pn,p->mn", s, t, N[i] * dA, optimize=True)
                    for i, s, t in ((0, slopes[0], slopes[0]), (1, slopes[1], slopes[1]),
                                    (2, slopes[0], slopes[1]), (2, slopes[1], slopes[0]))
                )  # fmt: skip
                K[:n, :n] += K_bend + geometric
                force = np.einsum("ipm,ip,p->m", every, N, dA, optimize=True)
                force[:n] += K_bend @ q[:n] - pressure * load
                scale = 1 / np.sqrt(np.diag(K))
                step = -scale * np.linalg.solve(K * np.outer(scale, scale), scale * force)
                q = q + step
                if np.abs(step[:n] @ middle) < 1e-10 * np.abs(q[:n] @ middle):
                    break
            else:
                raise RuntimeError(f"no equilibrium was found at {pressure} Pa")
            found.append(q[:n] @ middle)
        return np.array(found)

    def _terms(self):
        """Pairs of polynomials in x and y of the deflection and of both displacements in the plane."""
        bubble, one = Polynomial([1, 0, -1]), Polynomial([1])
        across = bubble**2 if self.clamped else bubble
        even = [Legendre.basis(2 * i).convert(kind=Polynomial) for i in range(self.terms)]
        odd = [Legendre.basis(2 * i + 1).convert(kind=Polynomial) for i in range(self.terms)]
        normal = bubble if self.edges != "free" else one
        along = bubble if self.edges == "held" else one
        w = [(across * p, across * q) for p in even for q in even]
        u = [(normal * p, along * q) for p in odd for q in even]
        if self.edges == "straight":
            u.append((Polynomial([0, 1]), one))
        v = [(y, x) for x, y in u]
        return w, u, v


POINTS, WEIGHTS = np.polynomial.legendre.leggauss(30)


def _products(terms, dx, dy):
    """Values (points, terms) of products of polynomials, differentiated so often in x and in y."""
    columns = [np.outer(x.deriv(dx)(POINTS) if dx else x(POINTS), y.deriv(dy)(POINTS) if dy else y(POINTS)).ravel()
               for x, y in terms]  # fmt: skip
    return np.column_stack(columns)
