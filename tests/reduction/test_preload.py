"""Bodies about loaded states: cables, chains, tethers, trusses."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import hyp2f1, jn_zeros

from femflex.dynamics import compile_system
from femflex.fem import Material, Member, PointMass, build_structure
from femflex.fem.sections import CableSection, Circle
from femflex.linear.equations import linearised
from femflex.mesh import Mesh, line
from femflex.reduction import cantilever_modes, reduce_structure, with_derivatives
from femflex.reduction.preload.equilibrium import static_equilibrium
from femflex.reduction.preload.loads import OrbitField, Preload, loads_of_preload
from femflex.system import Frame, System, weld

CORD = CableSection(1e9, 0.3)  # 1e9 N: stretched by parts in 1e8
PIN = {"start": ("x", "y", "z")}
PINS = {**PIN, "end": ("x", "y", "z")}
G = 9.81


def cord(to, n=8, section=CORD, masses=(), **options):
    """A tether from the origin."""
    member = Member("line", "tether", section, None, options)
    return build_structure(line([[0, 0, 0], to], n), [member], masses)


def tension(structure):
    """Places (p, 3) of points of strain, and the tension there (p,)."""
    (block,) = structure.strain
    return block.places.reshape(-1, 3), block.lowest_tension().ravel()


def test_a_hanging_chain_has_the_frequencies_of_bessel_functions():
    chain = static_equilibrium(cord([0, 0, -3.0], 10), PIN, Preload([0, 0, -G]))
    found = cantilever_modes(chain, PIN, 8).omega
    assert found == pytest.approx(np.repeat(jn_zeros(0, 4), 2) / 2 * np.sqrt(G / 3), rel=1e-6)
    x, T = tension(chain)
    assert T == pytest.approx(0.3 * G * (3 + x[:, 2]), abs=1e-7 * 0.3 * G * 3)


def spun(strain, rate=2.0, found_at=2.0):
    """Frequencies of a spun cable over its spin, lag and flap together."""
    cable = static_equilibrium(cord([3.0, 0, 0], 8, CableSection(1e8, 0.3)), PIN, Preload(spin=[0, 0, found_at]))
    modes = cantilever_modes(cable, PIN, 6)
    modes = modes if strain == "linear" else with_derivatives(cable, modes, 8)
    body = reduce_structure(cable, modes, strain=strain, turning=())
    frame = Frame("spinning", np.array([0, 0, rate]))
    model = compile_system(System({"cable": body}, (weld("cable", child_marker="start"),), frame=frame))
    found = linearised(model, 0.0, np.zeros(model.n_x)).eigenvalues().imag / rate
    return np.sort(found[found > 0.1])[:5]


FLAP = np.sqrt([1, 6, 15])
LAG = np.sqrt([5, 14])  # and 0


@pytest.mark.parametrize("strain", ["linear", "nonlinear", "condensed"])
def test_a_spun_cable_has_the_frequencies_of_legendre_functions(strain):
    assert spun(strain) == pytest.approx(np.sort([*FLAP, *LAG]), rel=1e-6)


def test_tension_of_condensed_cable_follows_spin():
    assert spun("condensed", rate=3.0) == pytest.approx(np.sort([*FLAP, *LAG]), rel=1e-6)


def test_a_string_between_fixed_ends_hardens_as_by_kirchhoff():
    """Its mean stretch (pi a / L)^2 / 4 in a sine of amplitude a stores EA L / 2 times the square of that."""
    EA, T = 1e7, 50.0
    string = cord([3.0, 0, 0], 8, CableSection(EA, 0.3), prestress=T)
    modes = with_derivatives(string, cantilever_modes(string, PINS, 2))
    body = reduce_structure(string, modes, {"middle": "line"}, strain="condensed", turning=())
    d = np.array([0.002, 0.0])
    middle = string.mesh.points[:, 0] == 1.5
    a = np.linalg.norm((string.translation @ modes.phi[:, 0]).reshape(-1, 3)[middle]) * d[0]
    energy = T * np.pi**2 * a**2 / 12 + EA * 3 / 2 * ((np.pi * a / 3) ** 2 / 4) ** 2
    assert energy > 1.01 * T * np.pi**2 * a**2 / 12
    assert body.strain.energy(d) == pytest.approx(energy, rel=1e-5)  # T / EA


def test_a_slack_cable_finds_its_catenary():
    half, arc, EA, q = 4.0, 5.0, 1e6, 2.0 * G
    mesh = line([[-half, 0, 0], [0, 0, -np.sqrt(arc**2 - half**2)], [half, 0, 0]], 24)
    structure = build_structure(mesh, [Member("line", "tether", CableSection(EA, 2.0))])
    found = static_equilibrium(structure, PINS, Preload([0, 0, -G]))

    def x_at(s, H):  # Irvine, Cable Structures (1981): elastic catenary, from the lowest point
        return H / q * np.arcsinh(q * s / H) + H * s / EA

    H = brentq(lambda H: x_at(arc, H) - half, 1e-3, 1e4)
    low = min(found.mesh.points[:, 2])
    assert low == pytest.approx(H / q * (1 - np.hypot(1, q * arc / H)) - q * arc**2 / 2 / EA, rel=1e-6)
    s = np.linspace(-arc, arc, 25)
    assert found.mesh.points[np.argsort(mesh.points[:, 0]), 0] == pytest.approx(x_at(s, H), abs=4e-6)
    T = tension(found)[1]
    assert T.max() == pytest.approx(np.hypot(H, q * arc), rel=1e-2)
    assert T.min() == pytest.approx(H, rel=1e-4)


N = 1.1e-3  # rad/s


def vertical(length, tip, mass=0.005):
    """A tether up from the orbit point, in its equilibrium, and its loads."""
    masses = [PointMass("end", tip)] if tip else []
    tether = cord([0, length, 0], 12, CableSection(1e9, mass), masses)
    load = Preload(orbit=OrbitField("y", "x", N))
    found = static_equilibrium(tether, PIN, load)
    return found, loads_of_preload(found, load).S


def frequencies(structure, S, axis):
    """Frequencies over N of small motions along an axis, by K - S, M of the dofs along it."""
    nodes = structure.translation[axis::3].tocoo().col
    extra = structure.numbering.fading_dofs.reshape(-1, 3)[:, axis]
    dofs = np.concatenate([np.unique(nodes), extra])
    dofs = np.setdiff1d(dofs, structure.constrained_dofs(PIN))
    K = (structure.K - S)[dofs][:, dofs].toarray()
    return np.sqrt(eigh(K, structure.M[dofs][:, dofs].toarray(), eigvals_only=True)[:3]) / N


def in_plane(ratio):
    """Squares of the first three in-plane frequencies over N of an inextensible tether whose tip has `ratio` of its
    mass.

    T = 3/2 n^2 m' (a^2 - x^2), a^2 = L^2 (1 + 2 ratio); (T w')' + omega^2 m' w = 0 with w(0) = 0 is Legendre's equation
    in x/a, w = x 2F1((1 - v)/2, 1 + v/2; 3/2; x^2/a^2), v (v + 1) = (omega/n)^2 / 1.5; at the tip T w' = omega^2 m w.
    """
    a = np.sqrt(1 + 2 * ratio)

    def misfit(square):
        v = (-1 + np.sqrt(1 + 4 * square / 1.5)) / 2
        p, q, z = (1 - v) / 2, 1 + v / 2, 1 / a**2
        w, slope = hyp2f1(p, q, 1.5, z), 2 * z * p * q / 1.5 * hyp2f1(p + 1, q + 1, 2.5, z)
        return 3 * (w + slope) - square * w  # over n^2 m L: T = 3 n^2 m L at the tip

    squares = np.geomspace(2.0, 4000, 4000)
    values = np.array([misfit(s) for s in squares])
    at = np.flatnonzero(values[1:] * values[:-1] < 0)[:3]
    return np.array([brentq(misfit, squares[i], squares[i + 1]) for i in at])


@pytest.mark.parametrize("ratio", [0.0, 0.3, 2.0])
def test_a_vertical_tether_in_orbit_has_the_tension_and_the_frequencies_of_row_I(ratio):
    L, mass = 2000.0, 0.005
    tip = ratio * mass * L
    found, S = vertical(L, tip, mass)
    x, T = tension(found)
    y = x[:, 1]
    exact = 1.5 * N**2 * mass * (L**2 - y**2) + 3 * N**2 * tip * L
    assert T == pytest.approx(exact, abs=1e-5 * exact.max())
    squares = np.array([3.0, 18.0, 45.0]) if ratio == 0 else in_plane(ratio)
    assert squares[0] == pytest.approx(3.0)
    assert frequencies(found, S, 2) ** 2 == pytest.approx(squares, rel=1e-5)
    assert frequencies(found, S, 0) ** 2 == pytest.approx(squares + 1, rel=1e-5)


def test_internal_damping_dissipates_as_kelvin_voigt():
    """Stretch of a tether with a heavy end: c = tau k."""
    tau, EA, m = 0.01, 1e4, 5.0
    mass = PointMass("end", m)
    member = Member("line", "tether", CableSection(EA, 1e-6), None, {"viscosity": tau})
    structure = build_structure(line([[0, 0, 0], [2.0, 0, 0]], 2), [member], [mass])
    held = {"start": ("x", "y", "z"), "end": ("y", "z")}
    pulled = static_equilibrium(structure, held, Preload(forces={"end": [1e-3, 0, 0]}))
    body = reduce_structure(pulled, cantilever_modes(pulled, held, 22), turning=())
    stretch = int(np.argmin(np.abs(np.sqrt(np.diag(body.strain.V1)) - np.sqrt(EA / 2 / m))))
    k = body.strain.V1[stretch, stretch]
    assert k == pytest.approx(EA / 2 / m, rel=1e-5)
    assert body.damping[stretch, stretch] == pytest.approx(tau * k, rel=1e-5)
    across = np.argsort(np.diag(body.strain.V1))[1]
    assert body.damping[across, across] < 1e-6 * tau * k


METAL, A, H = Material(70e9, 0.3, 2700.0), 1.0, 2.0  # half span and height [m]
AREA = np.pi * 1e-4
L = np.hypot(A, H)


@pytest.fixture(scope="module")
def truss():
    mesh = Mesh(
        np.array([[0.3 - A, 0.4, 0.5], [0.3, 0.4, 0.5 + H], [0.3 + A, 0.4, 0.5]]),
        {"line": np.array([[0, 1], [1, 2]])},
        {"legs": {"line": np.arange(2)}},
        {"feet": np.array([0, 2]), "crown": np.array([1])},
    )
    structure = build_structure(mesh, [Member("legs", "rod", Circle(0.01), METAL)])
    return structure, cantilever_modes(structure, {"feet": ("x", "y", "z"), "crown": ("y",)}, 1)


def crown(structure, states) -> np.ndarray:
    """Displacements (k, 2) of the crown along x and z."""
    u = (structure.translation @ np.array(states).T).reshape(3, 3, -1)
    assert np.abs(u[[0, 2]]).max() == 0.0 and np.abs(u[1, 1]).max() == 0.0
    return u[1, [0, 2]].T


def energy(x, z):
    """EA L / 2 times the squares of Green's strains, the crown moved by (x, z)."""
    strains = [((A + side * x) ** 2 + (H + z) ** 2 - L**2) / (2 * L**2) for side in (1, -1)]
    return METAL.E * AREA * L / 2 * sum(e**2 for e in strains)


def slope(x, z):
    """Forces (2,) on the crown moved by (x, z)."""
    out = np.zeros(2)
    for side in (1, -1):
        at = np.array([A * side + x, H + z])
        out += METAL.E * AREA * L * ((at @ at - L**2) / (2 * L**2)) * at / L**2
    return out


CLAMP = {"feet": ("x", "y", "z"), "crown": ("y",)}


@pytest.mark.parametrize(("fx", "fz"), [(2e4, -1e5), (3e5, 4e6), (1e3, -4e6), (-2e6, -3e6), (5e6, 1e6)])
def test_truss_under_dead_load_is_in_stable_equilibrium(truss, fx, fz):
    """Where the load buckles it, it goes on to where its energy is least, an end of its way that is stable."""
    structure, _ = truss
    found = static_equilibrium(structure, CLAMP, Preload(forces={"crown": (fx, 0.0, fz)}))
    moved = found.mesh.points - structure.mesh.points
    assert not moved[[0, 2]].any() and moved[1, 1] == 0.0
    at = moved[1, [0, 2]]
    np.testing.assert_allclose(slope(*at), [fx, fz], atol=1e-8 * np.hypot(fx, fz))
    h = 1e-4 * np.eye(2)
    tangent = np.array([(slope(*(at + d)) - slope(*(at - d))) / 2e-4 for d in h])
    assert np.linalg.eigvalsh(tangent)[0] > 0.0
    assert energy(*at) - np.dot([fx, fz], at) < 0.0


@pytest.mark.parametrize("force", [3.0, -4e3, 5e6])
def test_two_bars_in_line_sag_by_the_cube_root_of_a_load_across_them(force):
    """EA (w / a)^3: they have no stiffness at first, so that no step is taken without a shift."""
    mesh = Mesh(
        np.array([[-A, 0, 0], [0, 0, 0], [A, 0, 0]]),
        {"line": np.array([[0, 1], [1, 2]])},
        {"legs": {"line": np.arange(2)}},
        {"feet": np.array([0, 2]), "crown": np.array([1])},
    )
    structure = build_structure(mesh, [Member("legs", "rod", Circle(0.01), METAL)])
    found = static_equilibrium(structure, CLAMP, Preload(forces={"crown": (0.0, 0.0, force)}))
    assert found.mesh.points[1] == pytest.approx([0.0, 0.0, A * np.cbrt(force / (METAL.E * AREA))], rel=1e-7, abs=1e-9)
    assert np.array_equal(found.mesh.points[[0, 2]], mesh.points[[0, 2]])
