"""Beams whose sections turn: propeller moment, equations over points, and beams without rotary inertia."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.linalg import eigh
from support.pointwise import equations
from support.random_table import DependentTree, at_rest, elastic_forces

from femflex import fem
from femflex.dynamics import compile_system
from femflex.integrate import integrator
from femflex.linear.equations import linearised
from femflex.linear.equilibrium import equilibrium
from femflex.mesh import box, line
from femflex.reduction import (
    BeamFunctions,
    UniformBeam,
    beam_body,
    cantilever_modes,
    reduce_structure,
    with_attachment,
    with_derivatives,
)
from femflex.system import Frame, System, free, revolute, weld

LENGTH, MASS, RY, RZ, EA, GJ = 5.7, 6.0, 0.004, 0.06, 5e8, 1.08e4  # a torsion frequency near 31 Hz


@dataclass(frozen=True)
class Blade:
    """A blade along x that spins about z, its chord at an angle to the plane of rotation."""

    setting: float = 0.0

    @property
    def chord(self):
        return np.array([0.0, np.cos(self.setting), np.sin(self.setting)])

    def analytic(self, strain, torsion=6, bending=3):
        beam = UniformBeam(
            LENGTH, EA, EA * RY**2, EA * RZ**2, GJ, MASS, RY, RZ, direction=(1, 0, 0), orientation=self.chord
        )
        functions = BeamFunctions(
            y=bending, z=bending, torsion=torsion, axial=0 if strain == "condensed" else 8, family="polynomial"
        )
        return beam_body(beam, functions, strain=strain)

    def meshed(self, strain, modes=14):
        section = fem.sections.StiffnessSection(EA, EA * RY**2, EA * RZ**2, GJ, MASS, ry=RY, rz=RZ)
        member = fem.Member("line", "beam", section, None, {"orientation": self.chord, "order": 5})
        structure = fem.build_structure(line([[0, 0, 0], [LENGTH, 0, 0]], 4), [member])
        shapes = with_derivatives(structure, cantilever_modes(structure, "start", modes))
        return reduce_structure(structure, shapes, {"tip": "end"}, strain=strain)

    def torsion(self, spin):
        """Lowest frequency: int (GJ + T r^2) theta'^2 + m (rz^2 - ry^2) cos(2 setting) spin^2 theta^2, T the pull.

        The propeller moment is the twisting part of the potential -1/2 spin^2 int y^2 dm of a section's points.
        """
        x, weight = leggauss(60)
        s, weight = (x + 1) / 2, weight / 2 * LENGTH
        n = np.arange(1, 13)
        value, slope = s[:, None] ** n, n * s[:, None] ** (n - 1) / LENGTH
        polar, apart = RY**2 + RZ**2, (RZ**2 - RY**2) * np.cos(2 * self.setting)
        pull = MASS * spin**2 * LENGTH**2 * (1 - s**2) / 2
        K = slope.T @ ((weight * (GJ + pull * polar))[:, None] * slope)
        K += value.T @ ((weight * MASS * apart * spin**2)[:, None] * value)
        return np.sqrt(eigh(K, value.T @ ((weight * MASS * polar)[:, None] * value), eigvals_only=True)[0])


def frequencies(body, spin):
    frame = Frame("spinning", np.array([0.0, 0.0, spin]))
    found = equilibrium(System({"blade": body}, (weld("blade"),), frame=frame)).eigenvalues.imag
    return np.sort(found[found > 0])


def nearest_value(found, wanted):
    return found[np.abs(found - wanted).argmin()]


SPIN = 400 * 2 * np.pi / 60


@pytest.mark.sampled(1)
@pytest.mark.parametrize("setting", [0.0, np.pi / 2])
@pytest.mark.parametrize("strain", ["condensed", "nonlinear"])
@pytest.mark.parametrize("made", ["analytic", "meshed"])
def test_torsion_frequency_with_propeller_moment(made, strain, setting):
    blade = Blade(setting)
    exact = blade.torsion(SPIN)
    assert blade.torsion(0.0) == pytest.approx(np.pi / 2 * np.sqrt(GJ / MASS / (RY**2 + RZ**2)) / LENGTH, rel=1e-6)
    assert abs(exact / blade.torsion(0.0) - 1) > 1e-3
    found = nearest_value(frequencies(getattr(blade, made)(strain), SPIN), exact)
    assert found == pytest.approx(exact, rel=4e-6)


def test_propeller_moment_varies_with_cosine_of_twice_the_angle():
    """The steady twist that it brings about as well, left out of the answer, counts 3e-4."""
    exact = Blade(0.5).torsion(SPIN)
    found = nearest_value(frequencies(Blade(0.5).meshed("condensed"), SPIN), exact)
    assert found == pytest.approx(exact, rel=5e-4)
    assert exact / Blade(0.0).torsion(SPIN) == pytest.approx(1 - np.sin(0.5) ** 2 * (SPIN / exact) ** 2, rel=1e-3)


@pytest.mark.slow
def test_propeller_moment_of_solid_blade():
    """d(omega^2) / d(spin^2) of torsion: int (1 - s^2)/2 theta'^2 / int theta^2 by the pull, and the moments' ratio."""
    length, wide, thick, spin = 1.0, 0.06, 0.012, 60.0
    mesh = box(length, wide, thick, 10, 2, 1, cell="hexahedron27").translated([0, -wide / 2, -thick / 2])
    member = fem.Member("volume", "solid", None, fem.Material(70e9, 0.3, 2700.0))
    structure = fem.build_structure(mesh, [member])
    modes = cantilever_modes(structure, "left", 7)
    corners = mesh.points[:, 0] > length - 1e-9
    tips = (structure.translation @ modes.phi).reshape(-1, 3, 7)[corners]
    twist = np.abs(np.einsum("p,pk->k", mesh.points[corners, 1], tips[:, 2]))
    still = modes.omega[twist.argmax()]
    body = reduce_structure(structure, with_derivatives(structure, modes, "all"), strain="condensed")
    found = nearest_value(frequencies(body, spin), still * (1 + spin**2 / still**2))
    s = (np.arange(4000) + 0.5) / 4000
    pull = np.sum((1 - s**2) / 2 * (np.pi / 2 * np.cos(np.pi * s / 2)) ** 2) / np.sum(np.sin(np.pi * s / 2) ** 2)
    gain = pull + (wide**2 - thick**2) / (wide**2 + thick**2)
    assert (found**2 - still**2) / spin**2 == pytest.approx(gain, rel=0.01)


@pytest.fixture(scope="module")
def corner():
    """Two beams of oblique sections that meet at an angle, as a nonlinear body, and its points with what moves them."""
    section = fem.sections.StiffnessSection(1e7, 5e3, 2e4, 1e3, 3.0, ry=0.03, rz=0.08)
    member = fem.Member("line", "beam", section, None, {"orientation": (0.3, 0.5, 1.0)})
    structure = fem.build_structure(line([[0.2, 0, 0], [1.5, 0.4, 0.2], [2.0, 1.6, -0.3]], 4), [member])
    shapes = cantilever_modes(structure, "start", 5)
    body = reduce_structure(structure, shapes, {"a": "start", "b": "end"}, strain="nonlinear")
    (block,) = structure.inertia
    raw = (structure.T @ shapes.phi)[block.dofs]
    line_of = block.rho.reshape(*block.second.shape[:2], 4, 3).mean(axis=2, keepdims=True)
    o = (block.rho.reshape(*block.second.shape[:2], 4, 3) - line_of).reshape(-1, 3)
    phi = np.matmul(block.N, raw[:, None]).reshape(-1, 3, 5)
    dm, rho = block.dm.ravel(), block.rho.reshape(-1, 3)
    S = np.einsum("p,pa,pb->ab", dm, o, o)
    W = np.linalg.solve(S, body.moments.second[0][:, 6:].transpose(1, 0, 2)).swapaxes(1, 2)  # of int rho (W o)^T dm
    return body, (dm, rho, np.concatenate([phi, np.einsum("mab,pb->pam", W, o)], axis=2))


def test_equations_with_turned_sections_match_kane(corner):
    body, cloud = corner
    craft = System({"blade": body}, (free("blade", child_marker="a"),))
    rng = np.random.default_rng(3)
    model = compile_system(craft)
    q = np.concatenate([rng.normal(size=3), [0.5, 0.5, -0.5, 0.5], 0.1 * rng.normal(size=body.n_modes)])
    u, udot = rng.normal(size=(2, model.n_u))
    still = DependentTree(craft, {"blade": cloud})
    theirs = equations(still, q, u, udot, at_rest, lambda m, r: np.zeros((len(m), 3)))
    theirs = theirs + elastic_forces(craft, q, u)
    ours = model.residual(0.0, np.concatenate([q, u]), udot)
    assert ours == pytest.approx(theirs, rel=1e-10, abs=1e-10 * np.abs(theirs).max())


def test_tumbling_blade_conserves_energy_and_momentum():
    body = Blade().meshed("condensed", modes=8)
    u0 = np.array([0.1, 0.2, 0.0, 9.0, 2.0, 12.0])
    craft = System({"blade": body}, (free("blade", u0=u0),))
    model = compile_system(craft)
    times = np.linspace(0, 0.5, 21)
    states = integrator("dop853", rtol=1e-12, atol=1e-13).solve(model, times, model.x0).states
    seen = model.observe(times, states)
    for path in ("energy", "momentum", "angular_momentum"):
        monitor = seen[f"monitors/{path}"]
        assert np.ptp(monitor, axis=0).max() < 1e-10 * np.abs(monitor).max()
    assert np.abs(np.diff(states[:, 7 + 6], axis=0)).max() > 0


RY_OF_WITHOUT_ROTARY_INERTIA, RZ_OF_WITHOUT_ROTARY_INERTIA = (
    0.03,
    0.02,
)  # of a length of 1: 4, 12.5 and 23 % in the first three frequencies if counted in rigid turns
EIY, EIZ, GJ_OF_WITHOUT_ROTARY_INERTIA = 1.0, 1.3, 0.7
FREE_FREE = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671]) ** 2
HINGED_FREE = np.array([3.926602312047919, 7.068582745628732, 10.210176122813031]) ** 2
TORSION = np.sqrt(GJ_OF_WITHOUT_ROTARY_INERTIA / (RY_OF_WITHOUT_ROTARY_INERTIA**2 + RZ_OF_WITHOUT_ROTARY_INERTIA**2))


def straight():
    section = fem.sections.StiffnessSection(
        1e6,
        EIY,
        EIZ,
        GJ_OF_WITHOUT_ROTARY_INERTIA,
        1.0,
        ry=RY_OF_WITHOUT_ROTARY_INERTIA,
        rz=RZ_OF_WITHOUT_ROTARY_INERTIA,
    )
    member = fem.Member("line", "beam", section, None, {"order": 6, "orientation": (0, 1, 0), "rotary_inertia": False})
    return fem.build_structure(line([[0, 0, 0], [1, 0, 0]], 6), [member])


def meshed():
    structure = straight()
    shapes = with_attachment(structure, cantilever_modes(structure, "start", 20), ("x", "y", "z", "rx", "ry", "rz"))
    return reduce_structure(structure, shapes, {"root": "start"})


def analytic(rotary=False):
    beam = UniformBeam(
        1.0,
        1e6,
        EIY,
        EIZ,
        GJ_OF_WITHOUT_ROTARY_INERTIA,
        1.0,
        RY_OF_WITHOUT_ROTARY_INERTIA,
        RZ_OF_WITHOUT_ROTARY_INERTIA,
        rotary_inertia=rotary,
        orientation=(0, 1, 0),
    )
    return beam_body(beam, BeamFunctions(y=12, z=12, torsion=8, family="polynomial"))


def frequencies_of_without_rotary_inertia(body, joint):
    model = compile_system(System({"beam": body}, (joint,)))
    found = linearised(model, 0.0, model.x0).eigenvalues().imag
    return np.sort(found[found > 1.0])


@pytest.mark.parametrize("body", [meshed, analytic], ids=["meshed", "analytic"])
def test_free_beam_without_rotary_inertia_has_exact_frequencies(body):
    """(beta L)^2 sqrt(EI / m L^4) of a free beam in both planes, and n pi sqrt(GJ / m p) of its twist."""
    found = frequencies_of_without_rotary_inertia(body(), free("beam"))
    exact = np.concatenate([np.sqrt(EI) * FREE_FREE for EI in (EIY, EIZ)] + [np.pi * np.arange(1, 3) * TORSION])
    assert found[: len(exact) - 1] == pytest.approx(np.sort(exact)[:-1], rel=1e-5)


@pytest.mark.parametrize("body", [meshed, analytic], ids=["meshed", "analytic"])
def test_hinged_beam_without_rotary_inertia_has_exact_frequencies(body):
    """About y: that of a hinged beam in x-z; in x-y it stays clamped."""
    found = frequencies_of_without_rotary_inertia(body(), revolute("beam", axis=(0, 1, 0), child_marker="root"))
    for exact in HINGED_FREE * np.sqrt(EIY):
        assert np.abs(found / exact - 1).min() < 1e-5


def test_inertia_without_rotary_inertia_is_that_of_line():
    """m L^2 / 3 about the root, and m (ry^2 + rz^2) along the beam."""
    for body in (meshed(), analytic()):
        Q = body.moments.second[0, :, 0, :]
        expected = np.diag([RY_OF_WITHOUT_ROTARY_INERTIA**2 + RZ_OF_WITHOUT_ROTARY_INERTIA**2, 1 / 3, 1 / 3])
        assert np.trace(Q) * np.eye(3) - Q == pytest.approx(expected, abs=1e-12)
