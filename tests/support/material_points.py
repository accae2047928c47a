"""Integrals over the material of a deploying member, point by point: differences at a material point that stays itself.

Nothing but the admissible functions, their columns and the amplitudes of what follows is taken from a member.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from femflex.body import Marker, MassMoments

H = 2e-3  # step of differences, of the length
FIRST = {-2: 1 / 12, -1: -8 / 12, 1: 8 / 12, 2: -1 / 12}
SECOND = {-2: -1 / 12, -1: 16 / 12, 0: -30 / 12, 1: 16 / 12, 2: -1 / 12}


def gauss_of(breaks, n=16):
    """Points and weights between neighbours of breaks."""
    x, w = np.polynomial.legendre.leggauss(n)
    a, b = np.asarray(breaks)[:-1, None], np.asarray(breaks)[1:, None]
    return (a + (b - a) * (x + 1) / 2).ravel(), ((b - a) * w / 2).ravel()


def slope_of(f, L):
    """df/dL by differences of fourth order."""
    return sum(c * f(L * (1 + k * H)) for k, c in FIRST.items()) / (L * H)


def bend_of(f, L):
    """d2f/dL2 likewise."""
    return sum(c * f(L * (1 + k * H)) for k, c in SECOND.items()) / (L * H) ** 2


def frame_of(direction, near):
    """Rows x, y, z: x along the member, y in the plane of x and a vector near it."""
    x = np.asarray(direction, float) / np.linalg.norm(direction)
    y = np.asarray(near, float) - x * (x @ near)
    y /= np.linalg.norm(y)
    return np.array([x, y, np.cross(x, y)])


@dataclass
class Material:
    """A member with fields(xi, derivative by xi) (k, m, 3 or 4, n) over its columns at points of a section.

    offsets (m, 3), share (m,); slope_products(xi) (k, n, n): mean of products of slopes by xi; slaves (n_s, n, n)
    density: mass per length at sigma; stock [m]; breaks: of sigma, where density is not smooth; knots: of xi
    """

    root: Any
    frame: Any
    moved: Any
    slope_products: Any
    slaves: Any
    offsets: Any
    share: Any
    density: Any
    stock: float
    at_tip: bool
    breaks: tuple[float, ...] = ()

    def sigma(self, xi, L):
        """Distance from the end that came out first."""
        return L * (xi if self.at_tip else 1 - xi)

    def xi(self, sigma, L):
        """Position xi of a material point."""
        return sigma / L if self.at_tip else 1 - sigma / L

    def foreshortening(self, xi):
        """F_s(xi) (k, n_s): - sum over pairs of the integrals of slopes, resolved into the amplitudes' A_s."""
        n_s = len(self.slaves)
        if not n_s:
            return np.zeros((len(xi), 0))
        x, w = gauss_of([0.0, 1.0])
        products = self.slope_products(np.outer(xi, x).ravel()).reshape(len(xi), len(x), -1)
        integral = xi[:, None] * np.einsum("q,kqp->kp", w, products)
        return -integral @ self.resolving

    @cached_property
    def resolving(self):
        """(n^2, n_s): amplitudes A_s of products of slopes."""
        return np.linalg.pinv(self.slaves.reshape(len(self.slaves), -1))

    def z(self, xi, L):
        """(k, m, 3, 1 + n + n_s): place and shapes, body frame."""
        local = self.moved(xi, L)
        n = local.shape[-1]
        out = np.zeros((len(xi), len(self.offsets), 3, 1 + n + len(self.slaves)))
        out[..., 0] = self.offsets
        out[:, :, 0, 0] += (L * xi)[:, None]
        out[..., 1 : 1 + n] = local
        out[:, :, 0, 1 + n :] = self.foreshortening(xi)[:, None] / L
        out = np.einsum("ab,kmaA->kmbA", self.frame, out)
        out[..., 0] += np.asarray(self.root, float)
        return out

    def integrals(self, L):
        """mass, first, second, X, Y, C: over deployed and stowed material, per rate of the length."""
        kinks = [0.0, *sorted(b for b in self.breaks if b < L), L]
        sigma, w = gauss_of(kinks)
        dm = (w * self.density(sigma))[:, None] * self.share
        z = self.z(self.xi(sigma, L), L)
        chi = slope_of(lambda length: self.z(self.xi(sigma, length), length), L)
        end = np.array([1.0 if self.at_tip else 0.0])
        s, v = gauss_of([L, *sorted(b for b in self.breaks if L < b < self.stock), self.stock])
        stowed = v @ self.density(s) * self.share
        z0 = self.z(end, L)[0]
        chi0 = slope_of(lambda length: self.z(end, length)[0], L) if self.at_tip else 0 * z0
        return {
            "mass": dm.sum() + stowed.sum(),
            "first": np.einsum("km,kmaA->Aa", dm, z) + np.einsum("m,maA->Aa", stowed, z0),
            "second": np.einsum("km,kmaA,kmbB->AaBb", dm, z, z) + np.einsum("m,maA,mbB->AaBb", stowed, z0, z0),
            "X": np.einsum("km,kmaA->Aa", dm, chi) + np.einsum("m,maA->Aa", stowed, chi0),
            "Y": np.einsum("km,kmaA,kmbB->AaBb", dm, z, chi) + np.einsum("m,maA,mbB->AaBb", stowed, z0, chi0),
            "C": np.einsum("km,kmaA,kmbB->AaBb", dm, chi, chi) + np.einsum("m,maA,mbB->AaBb", stowed, chi0, chi0),
        }

    def pickup(self, L):
        """Mass per length at the drum, times the squares of what velocities jump by there per rate of the length."""
        end, here = np.array([1.0 if self.at_tip else 0.0]), np.array([L])
        jump = slope_of(lambda length: self.z(self.xi(here, length), length)[0], L)
        if self.at_tip:
            jump = jump - slope_of(lambda length: self.z(end, length)[0], L)
        return self.density(here)[0] * np.einsum("m,maA,maB->AB", self.share, jump, jump)

    def block(self, block, L, U, A, others):
        """The record of a table; others: functions of the block and the length that write its other fields."""
        now = self.integrals(L)
        near = {k: self.integrals(L * (1 + k * H)) for k in FIRST}
        rate = {key: sum(c * near[k][key] for k, c in FIRST.items()) / (L * H) for key in ("X", "Y", "C")}
        trace, trace_rate = (np.einsum("AaBa->AB", part) for part in (now["C"], rate["C"]))
        out = np.zeros(block.size)
        block.put_moments(out, MassMoments(now["mass"], now["first"], now["second"]))
        block.put_flow(
            out,
            drift=U * now["X"],
            kick=A * now["X"] + U**2 * rate["X"],
            flow=U * now["Y"],
            turn=A * now["Y"] + U**2 * (rate["Y"] - now["C"]),
            speed=U**2 * trace,
            speed_rate=2 * U * A * trace + U**3 * trace_rate,
        )
        block.put_pickup(out, self.pickup(L))
        others(block, out)
        return out


def put_markers(block, out, markers, orientations, axes, L, U, A):
    """markers: name -> function of the length: (position, phi, psi)."""
    for name, place in markers.items():
        parts = [lambda length, k=k, place=place: place(length)[k] for k in range(3)]
        now = [part(L) for part in parts]
        first, second = [slope_of(part, L) for part in parts], [bend_of(part, L) for part in parts]
        block.put_place(out, name, Marker(*now, orientations[name], axes[name]))
        block.put_motion(out, name, 1, *(U * one for one in first))
        block.put_motion(out, name, 2, *(A * one + U**2 * two for one, two in zip(first, second, strict=True)))
