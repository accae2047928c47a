"""Plates clamped to a hub that spins: all their finite elements, and reduced bodies.

All in units of the plate: length, mass per area and bending stiffness D are 1, so that a frequency is
omega L^2 sqrt(rho h / D) and the spin is gamma = Omega L^2 sqrt(rho h / D). The plate lies along x from the hub, whose
radius is `hub`; at setting angle 0 its normal is the axis, at 90 degrees it is the direction of flight.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from femflex import fem, reduction
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.linear.equilibrium import equilibrium
from femflex.mesh import rectangle
from femflex.reduction.boundary.rigid import held_dofs
from femflex.system import Frame, Profile, System, revolute, weld
from support.full_spin import Spun


@dataclass(frozen=True)
class Rise:
    """A spin that rises smoothly from rest to `speed` in the time `over`: speed (t / T - sin(2 pi t / T) / 2 pi)."""

    speed: float
    over: float

    def angle(self, t):
        s = np.minimum(t / self.over, 1.0)
        early = s**2 / 2 + (np.cos(2 * np.pi * s) - 1) / (2 * np.pi) ** 2
        return self.speed * self.over * (early + np.maximum(t / self.over - 1.0, 0.0))

    def rate(self, t):
        s = np.minimum(t / self.over, 1.0)
        return self.speed * (s - np.sin(2 * np.pi * s) / (2 * np.pi))

    def turn(self, t):
        s = np.minimum(t / self.over, 1.0)
        return self.speed / self.over * (1 - np.cos(2 * np.pi * s))


@dataclass(frozen=True)
class SpinningPlate:
    """A plate of unit length; cells: elements along x and y; setting in degrees."""

    width: float = 1.0
    thickness: float = 0.01
    nu: float = 0.3
    hub: float = 0.0
    setting: float = 0.0
    cells: tuple[int, int] = (6, 6)

    @property
    def axis(self):
        angle = np.deg2rad(self.setting)
        return np.array([0.0, np.sin(angle), np.cos(angle)])

    @property
    def modulus(self):
        return 12 * (1 - self.nu**2) / self.thickness**3

    @cached_property
    def structure(self):
        mesh = rectangle(1.0, self.width, *self.cells, "quad")
        mesh = replace(mesh, points=mesh.points + np.array([self.hub, -self.width / 2, 0.0]))
        material = fem.Material(self.modulus, self.nu, 1 / self.thickness)
        return fem.build_structure(mesh, [fem.Member("surface", "plate_bfs", self.thickness, material)])

    @cached_property
    def all_elements(self):
        """All its finite elements in the spinning frame."""
        return Spun(self.structure, held_dofs(self.structure, "left"), self.axis)

    def full_corners(self, rise, times, groups=("top_right",)):
        """Displacements (n_t, 3 k) of corners of all finite elements, spun up from rest."""
        nodes = np.concatenate([self.structure.mesh.group_points(group) for group in groups])
        rows = self.structure.translation[(3 * nodes[:, None] + np.arange(3)).ravel()][:, self.all_elements.free]
        return self.all_elements.motion(rise.rate, rise.turn, rows, times)

    def body(self, modes, strain="condensed", keep="auto", third=0):
        """The reduced body: vibration modes, static answers to accelerations of the clamp, and derivatives."""
        shapes = reduction.cantilever_modes(self.structure, "left", modes)
        shapes = reduction.with_attachment(self.structure, shapes, ("z", "rx", "ry"))
        shapes = reduction.with_third_derivatives(self.structure, shapes, third)
        if strain != "linear":
            shapes = reduction.with_derivatives(self.structure, shapes, keep)
        return reduction.reduce_structure(self.structure, shapes, {"corner": "top_right"}, strain=strain)

    def frequencies(self, body, gamma, count):
        """The lowest `count` frequencies of a body about its steady spin."""
        frame = Frame("spinning", gamma * self.axis)
        found = equilibrium(System({"plate": body}, (weld("plate", child_marker="origin"),), frame=frame))
        imaginary = np.sort(found.eigenvalues.imag)
        return imaginary[imaginary > 0][:count]

    def corner(self, body, rise, times, rtol=1e-8):
        """Displacement (n_t, 3) of the corner of a body spun up from rest."""
        knots = np.linspace(0.0, times[-1], 1501)
        turn = Profile.spline(knots, rise.angle(knots), 5)
        joint = revolute("plate", axis=self.axis, motion=(turn,), child_marker="origin")
        model = compile_system(System({"plate": body}, (joint,)))
        states = integrator("dop853", rtol=rtol, atol=rtol).solve(model, times, model.x0).states
        return model.observe(times, states)["markers/plate.corner/deflection"]
