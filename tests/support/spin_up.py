"""Row A: a beam spun up about its root, as one body or cut into segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femflex import fem, reduction, system
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.mesh import line
from femflex.reduction import BeamFunctions, UniformBeam, beam_body
from femflex.system import Profile, System, revolute

TIMES = np.linspace(0.0, 20.0, 401)


@dataclass(frozen=True)
class SpinUp:
    """A beam whose root turns by (Om / Ts) (t^2 / 2 + (Ts / 2 pi)^2 (cos(2 pi t / Ts) - 1)), then by Om (t - Ts / 2).

    tilt: angle of the beam out of the plane of rotation
    """

    length: float
    EA: float
    EI: float
    mass: float
    inertia: float
    speed: float
    rise: float = 15.0
    tilt: float = 0.0

    def angle(self, t):
        early = t**2 / 2 + (self.rise / (2 * np.pi)) ** 2 * (np.cos(2 * np.pi * t / self.rise) - 1)
        return self.speed * np.where(t < self.rise, early / self.rise, t - self.rise / 2)

    def joint(self, **more):
        knots = np.linspace(0.0, 30.0, 1501)
        turn = Profile.spline(knots, self.angle(knots), 5)
        return revolute("beam", axis=(0, 0, 1), motion=(turn,), child_marker="root", **more)

    @property
    def direction(self):
        return np.array([np.cos(self.tilt), 0.0, np.sin(self.tilt)])

    def body(self, strain, y=4, z=0, axial=0):
        radius = np.sqrt(self.inertia / self.mass)
        beam = UniformBeam(
            self.length, self.EA, self.EI, self.EI, self.EI, self.mass, radius, radius,
            direction=self.direction, orientation=(0, 1, 0),
        )  # fmt: skip
        return beam_body(beam, BeamFunctions(y=y, z=z, axial=axial, family="polynomial"), strain=strain)

    def single_body(self, strain, times=TIMES, rtol=1e-8, **functions):
        """Deflection of the tip (n_t, 3) of a single body, in the frame that turns with the root."""
        model = compile_system(System({"beam": self.body(strain, **functions)}, (self.joint(),)))
        states = integrator("dop853", rtol=rtol, atol=rtol).solve(model, times, model.x0).states
        return model.observe(times, states)["markers/beam.tip/deflection"]

    @property
    def section(self):
        """Its section, as beams on meshes take it."""
        radius = np.sqrt(self.inertia / self.mass)
        return fem.sections.StiffnessSection(self.EA, self.EI, self.EI, self.EI, self.mass, ry=radius, rz=radius)

    def mesh(self, elements):
        """The line from root to tip."""
        return line([[0, 0, 0], list(self.length * self.direction)], elements)

    def meshed(self, strain, n, elements=8, rtol=1e-8, times=TIMES):
        """Deflection of the tip of a single meshed body of n modes and the derivatives of "auto", in the same frame."""
        structure = fem.build_structure(self.mesh(elements), [fem.Member("line", "beam", self.section)])
        shapes = reduction.with_derivatives(structure, reduction.cantilever_modes(structure, "start", n))
        body = reduction.reduce_structure(structure, shapes, {"root": "start", "tip": "end"}, strain=strain)
        model = compile_system(System({"beam": body}, (self.joint(),)))
        method = "dop853" if strain == "condensed" else "esdirk4"
        states = integrator(method, rtol=rtol, atol=rtol).solve(model, times, model.x0).states
        return model.observe(times, states)["markers/beam.tip/deflection"]

    def segmented(self, k, times=TIMES, rtol=1e-6, shapes=reduction.chord_modes, strain="linear", cells=4):
        """The same of a beam cut into k segments."""
        pieces = fem.cut_into_segments(
            self.mesh(cells * k), [fem.Member("line", "beam", self.section)], k, start="start"
        )
        parts = reduction.reduce_segments(pieces, {"root": "start", "tip": "end"}, shapes, strain=strain)
        model = compile_system(system.assembled({"beam": system.Segments(parts)}, [self.joint()]))
        states = integrator("esdirk4", rtol=rtol, atol=rtol).solve(model, times, model.x0).states
        tip = model.observe(times, states)["markers/beam.tip/position"]
        c, s = np.cos(self.angle(times)), np.sin(self.angle(times))
        turned = np.stack([c * tip[:, 0] + s * tip[:, 1], c * tip[:, 1] - s * tip[:, 0], tip[:, 2]], axis=1)
        return turned - self.length * self.direction

    def segments_with_modes(self, k, strain, n=1, times=TIMES, rtol=1e-7, keep="auto"):
        """The same of k segments of that strain, each with its ends' shapes, n modes between, and derivatives."""

        def shapes(structure):
            return reduction.with_derivatives(structure, reduction.chord_modes(structure, n), keep)

        return self.segmented(k, times, rtol=rtol, shapes=shapes, strain=strain, cells=8)

    @property
    def stretch(self):
        """Steady extension of the tip, pure stretch: tan(k L) / k - L with k^2 = rho A Om^2 / EA."""
        k = np.sqrt(self.mass * self.speed**2 / self.EA)
        return np.tan(k * self.length) / k - self.length


KANE = SpinUp(10.0, 2.8e7, 1.4e4, 1.2, 6e-4, 6.0)
WU_HAUG = SpinUp(8.0, 6.8952e10 * 7.2968e-5, 6.8952e10 * 8.2189e-9, 2766.7 * 7.2968e-5, 2766.7 * 8.2189e-9, 4.0)
