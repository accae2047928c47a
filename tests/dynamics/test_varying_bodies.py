"""Bodies whose properties depend on time, defined here alone: no other file knows of them.

Physics of the spinning hub: two masses move out along x and -x inside a free rigid body, r(t) = 1 + U t. Nothing acts
on it, so its angular momentum stays; about a principal axis omega = H / I(t). The mechanism that moves the masses gives
the power int w . a dm. The mass matrix changes at dI/dt = int r w + w r: the row M_t u of the ledger.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.pointwise import Jet, Tree, equations, partial_velocities
from support.random_systems import random_tree
from support.random_table import elastic_forces
from support.scipy_integrators import integrator

from femflex.body import FlexibleBody, Marker, MassMoments, StrainTensors, rigid_body
from femflex.dynamics import compile_system
from femflex.system import (
    Block,
    Environment,
    System,
    Variation,
    free,
    weld,
)

U, MASS = 0.3, 2.5  # m/s; kg, of each of the two masses
MOVING = ("mass", "flow")
METHODS = ("dop853", "esdirk4", "scipy_radau")


def polynomial(t, z, numbers, block):
    """Writes a block that is a polynomial in time: numbers (degree + 1, size)."""
    for i in range(len(block)):
        value = 0.0
        for p in range(len(numbers) // len(block) - 1, -1, -1):
            value = value * t + numbers[p * len(block) + i]
        block[i] = value


def fitted(block_at, degree):
    """The coefficients of a block that is a polynomial in time of that degree, from as many instants."""
    times = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    return np.linalg.solve(np.vander(times, increasing=True), np.array([block_at(t) for t in times])).ravel()


def point_integrals(mass, z, dz, ddz):
    """Moments and material flow of points (n_p, 1 + n, 3), as `Block.put_moments` and `Block.put_flow` take them."""
    moments = MassMoments(mass.sum(), np.einsum("p,pAa->Aa", mass, z), np.einsum("p,pAa,pBb->AaBb", mass, z, z))
    drift, kick = np.einsum("p,pAa->Aa", mass, dz), np.einsum("p,pAa->Aa", mass, ddz)
    flow, turn = np.einsum("p,pAa,pBb->AaBb", mass, z, dz), np.einsum("p,pAa,pBb->AaBb", mass, z, ddz)
    speed = np.einsum("p,pAa,pBa->AB", mass, dz, dz)
    rate = np.einsum("p,pAa,pBa->AB", mass, dz, ddz)
    return moments, (drift, kick, flow, turn, speed, rate + rate.T)


def spinning_hub(omega=(0.0, 0.0, 2.0), **more):
    """A free hub in which two masses move out along x, and the same hub at the start of the clock."""
    core = np.diag([2.0, 1.0, 0.5])  # int rho rho^T dm of what stands still

    def block_numbers(t):
        r = 1.0 + U * t
        rho = np.array([[[r, 0, 0]], [[-r, 0, 0]]])
        w = np.array([[[U, 0, 0]], [[-U, 0, 0]]])
        moments, flow = point_integrals(np.array([MASS, MASS]), rho, w, 0 * w)
        out, second = np.zeros(block.size), moments.second + core.reshape(1, 3, 1, 3)
        block.put_moments(out, MassMoments(10.0, moments.first, second))
        block.put_flow(out, *flow)
        return out

    second = (core + np.diag([2 * MASS, 0, 0])).reshape(1, 3, 1, 3)
    moments = MassMoments(10.0, np.zeros((1, 3)), second)
    body = FlexibleBody(moments, StrainTensors.linear(np.zeros((0, 0))), np.zeros((0, 0)), {})
    block = Block(body, MOVING)
    varying = {"hub": Variation(polynomial, MOVING, fitted(block_numbers, 2))}
    joint = free("hub", u0=np.concatenate([np.zeros(3), omega]))
    return System({"hub": body}, (joint,), varying=varying, **more)


def spin_inertia(t):
    """Inertia of the hub about z."""
    return 2.0 + 1.0 + 2 * MASS * (1.0 + U * t) ** 2


@pytest.mark.parametrize("method", METHODS)
def test_spin_falls_as_inertia_grows(method):
    model, times = compile_system(spinning_hub()), np.linspace(0, 4, 21)
    solution = integrator(method, rtol=1e-10, atol=1e-12).solve(model, times, model.x0)
    seen = model.observe(times, solution.states)
    exact = 2.0 * spin_inertia(0.0) / spin_inertia(times)
    assert seen["bodies/hub/rate"][:, 2] == pytest.approx(exact, rel=1e-7)
    assert seen["bodies/hub/mass"] == pytest.approx(10.0)


def test_angular_momentum_with_moving_masses():
    model, times = compile_system(spinning_hub((0.3, -0.4, 1.0))), np.linspace(0, 4, 21)
    H = model.observe(times, integrator("dop853").solve(model, times, model.x0).states)["monitors/angular_momentum"]
    assert H[0] == pytest.approx([0.3 * 1.5, -0.4 * 7.5, 8.0])
    assert np.abs(H - H[0]).max() < 1e-9


def balance(model, x0, times):
    """Change of energy, and the integral of the power of the change by Gauss's rule on every interval."""
    nodes, weights = np.polynomial.legendre.leggauss(6)
    inner = np.concatenate([a + (b - a) * (1 + nodes) / 2 for a, b in pairwise(times)])
    every = np.concatenate([times[:1], inner, times[-1:]])
    seen = model.observe(every, integrator("dop853").solve(model, every, x0).states)
    power = seen["monitors/variation_power"][1:-1].reshape(-1, 6)
    work = np.sum(power @ weights * np.diff(times) / 2)
    return seen["monitors/energy"][-1] - seen["monitors/energy"][0], work


def test_power_of_moving_masses_is_rate_of_energy():
    model = compile_system(spinning_hub((0.3, -0.4, 1.0)))
    gained, work = balance(model, model.x0, np.linspace(0, 4, 21))
    assert abs(gained) > 0.1
    assert work == pytest.approx(gained, rel=1e-9)


def random_varying(seed, **more):
    """A random tree in which the material of one body and one of its markers move, and the clouds as jets at NOW."""
    system, clouds, state = random_tree(seed, **more)
    rng = np.random.default_rng(100 + seed)
    carrying = [joint.parent for joint in system.joints if joint.parent is not None]
    name = carrying[seed % len(carrying)]
    body, (mass, rho, phi) = system.bodies[name], clouds[name]
    n = body.n_modes
    z = [np.concatenate([rho[:, None], phi.swapaxes(1, 2)], axis=1)]
    z += [0.3 * rng.normal(size=z[0].shape) for _ in range(2)]
    markers = {}
    for key in ("a", "b", "c"):
        marker = body.marker(key)
        parts = [(marker.position, marker.phi, marker.psi)]
        parts += [tuple(0.3 * rng.normal(size=part.shape) for part in parts[0]) for _ in range(2)]
        markers[key] = parts
    varies = ("mass", "flow", *(f"marker/{key}" for key in markers))
    block = Block(body, varies)

    def material_motion(parts, t):
        value = parts[0] + parts[1] * t + parts[2] * t * t / 2
        return value, parts[1] + parts[2] * t, parts[2]

    def block_numbers(t):
        out = np.zeros(block.size)
        moments, flow = point_integrals(mass, *material_motion(z, t))
        block.put_moments(out, moments)
        block.put_flow(out, *flow)
        for key, parts in markers.items():
            place, jets = block.markers[key], [material_motion([part[i] for part in parts], t) for i in range(3)]
            out[place : place + 12] = np.concatenate([jets[0][0], body.marker(key).orientation.ravel()])
            out[place + 16 : place + 22] = np.concatenate(jets[0][1:])
            first = place + 24
            for jet in jets[1:]:
                for rows in jet:
                    out[first : first + 3 * block.wide].reshape(3, block.wide)[:, :n] = rows
                    first += 3 * block.wide
        return out

    system = replace(system, varying={name: Variation(polynomial, varies, fitted(block_numbers, 4))})

    def clouds_at(t, moving):
        zt = [part if moving else 0 * part for part in material_motion(z, t)]
        zt[0] = material_motion(z, t)[0]
        points = [Jet(*(part[p, 0] for part in zt)) for p in range(len(mass))]
        shapes = [Jet(*(part[p, 1:].T for part in zt)) for p in range(len(mass))]
        return {**clouds, name: (mass, points, shapes)}

    def markers_at(t, moving):
        found = {}
        for key, parts in markers.items():
            jets = [material_motion([part[i] for part in parts], t) for i in range(3)]
            position, phi_t, psi_t = (Jet(*jet) if moving else Jet(jet[0]) for jet in jets)
            found[key] = replace(body.marker(key), position=position, phi=phi_t, psi=psi_t)
        return found

    return system, name, clouds_at, markers_at, state


class MovingTree(Tree):
    """A tree of points some of which move by themselves."""

    def __init__(self, system, clouds, name, markers):
        super().__init__(system, clouds)
        self.own = {id(system.bodies[name].marker(key)): marker for key, marker in markers.items()}

    def marker(self, marker, delta):
        return Tree.marker(self.own.get(id(marker), marker), delta)


NOW = 0.4


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", [0, 2, 4, 5, 7, 8, 9, 1, 6, 3])  # the fast ones, 4 and 1, have three shapes
def test_moving_material_matches_kane(seed):
    system, name, clouds_at, markers_at, (q, u) = random_varying(seed)
    model = compile_system(system)
    udot = np.random.default_rng(seed).normal(size=model.n_u)
    ours = model.residual(NOW, np.concatenate([q, u]), udot)
    still = MovingTree(system, clouds_at(NOW, False), name, markers_at(NOW, False))
    moving = MovingTree(system, clouds_at(NOW, True), name, markers_at(NOW, True))
    base = lambda moves: Jet(np.eye(3))  # noqa: E731
    partial = partial_velocities(still, q, len(u), base)
    theirs = equations(moving, q, u, udot, base, lambda m, r: np.zeros((len(m), 3)), partial=partial)
    theirs = theirs + elastic_forces(system, q, u)
    assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-10 * np.abs(theirs).max(initial=1))
    x = np.concatenate([q, u])
    found = model.state_rate(NOW, x)[model.n_q :]
    assert model.residual(NOW, x, found) == pytest.approx(np.zeros(model.n_u), abs=1e-9 * np.abs(ours).max())


@pytest.mark.parametrize("seed", range(4))
def test_ledger_of_moving_material_sums_to_zero(seed):
    system, *_, (q, u) = random_varying(seed)
    model, x = compile_system(system), np.concatenate([q, u])
    found = model.terms(np.array([NOW]), x[None])
    assert {"moving_mass", "gyroscopic", "specified_motion"} <= set(found)
    largest = max(np.abs(rows).max() for rows in found.values())
    assert np.abs(sum(found.values())).max() < 1e-11 * largest


@pytest.mark.parametrize("seed", [0, 3])
def test_energy_balance_with_moving_markers(seed):
    """Bodies hang from markers that move; what their joints carry gives power there."""
    system, *_, (q, u) = random_varying(seed)
    bodies = {name: replace(body, damping=0.0 * body.damping) for name, body in system.bodies.items()}
    system = replace(system, bodies=bodies, environment=Environment(gravity=np.array([0.3, -1.0, 0.5])))
    model = compile_system(system)
    gained, work = balance(model, np.concatenate([q, 0.1 * u]), np.linspace(0, 0.3, 7))
    assert abs(gained) > 1e-3
    assert work == pytest.approx(gained, rel=1e-7)


OMEGA, DEPTH, RATE = 1.0, 0.4, 2.1


def parametric_oscillator(damping=0.0):
    """One elastic coordinate on a welded hub whose stiffness is OMEGA^2 (1 + DEPTH cos(RATE t))."""
    moments = MassMoments(2.0, np.zeros((2, 3)), np.zeros((2, 3, 2, 3)))
    moments.second[1, 2, 1, 2] = 1.0
    moments.second[0, :, 0, :] = np.eye(3)
    tip = Marker(np.array([1.0, 0, 0]), np.array([[0], [0], [1.0]]), np.zeros((3, 1)))
    V1 = np.array([[OMEGA**2 * (1 + DEPTH)]])
    body = FlexibleBody(moments, StrainTensors.linear(V1), np.array([[damping]]), {"tip": tip})
    at = Block(body, ("stiffness",))
    first, rate = at.stiffness, at.stiffness_rate

    def write(t, z, numbers, block):
        w2, depth, w = numbers[0], numbers[1], numbers[2]
        block[first] = w2 * (1.0 + depth * np.cos(w * t))
        block[rate] = -w2 * depth * w * np.sin(w * t)

    varying = {"beam": Variation(write, ("stiffness",), np.array([OMEGA**2, DEPTH, RATE]))}
    return System({"beam": body}, (weld("beam"),), delta0={"beam": np.array([0.01])}, varying=varying)


def mathieu(t, y):
    return [y[1], -(OMEGA**2) * (1 + DEPTH * np.cos(RATE * t)) * y[0]]


@pytest.mark.sampled(1)
@pytest.mark.parametrize("method", METHODS)
def test_parametric_oscillator_matches_mathieu(method):
    model, times = compile_system(parametric_oscillator()), np.linspace(0, 20, 81)
    solution = integrator(method, rtol=1e-10, atol=1e-13).solve(model, times, model.x0)
    exact = solve_ivp(mathieu, (0, 20), [0.01, 0.0], "DOP853", times, rtol=1e-12, atol=1e-15).y[0]
    assert solution.states[:, 0] == pytest.approx(exact, abs=1e-6 * np.abs(exact).max())


def test_energy_balance_with_varying_stiffness():
    model = compile_system(parametric_oscillator())
    gained, work = balance(model, model.x0, np.linspace(0, 20, 81))
    assert work == pytest.approx(gained, rel=1e-8)


def test_growing_mass_at_constant_spin():
    """Mass that arrives at the velocity of its place: omega stays, the energy grows by omega^2 dI/2."""
    body = rigid_body(4.0, np.diag([1.0, 2.0, 3.0]))
    parts = ("mass", "growth")
    block = Block(body, parts)

    def block_numbers(t):
        out, P = np.zeros(block.size), body.moments.second
        block.put_moments(out, MassMoments(4.0 + t, body.moments.first, (1 + t) * P))
        block.put_moments(out, MassMoments(1.0, 0 * body.moments.first, P), growth=True)
        return out

    varying = {"hub": Variation(polynomial, parts, fitted(block_numbers, 1))}
    model = compile_system(System({"hub": body}, (free("hub", u0=np.array([0.5, 0, 0, 0, 0, 2.0])),), varying=varying))
    times = np.linspace(0, 2, 5)
    seen = model.observe(times, integrator("dop853").solve(model, times, model.x0).states)
    assert seen["bodies/hub/rate"][:, 2] == pytest.approx(2.0)
    assert seen["bodies/hub/mass"] == pytest.approx(4.0 + times)
    assert seen["monitors/variation_power"] == pytest.approx(0.5 * 0.5**2 * 1.0 + 0.5 * 2.0**2 * 3.0)
    gained, work = balance(model, model.x0, np.linspace(0, 2, 5))
    assert work == pytest.approx(gained, rel=1e-11)


@pytest.mark.slow
def test_run_with_varying_body_resumes_exactly(write_case, tmp_path):
    """The file holds the channels; the same function handed over again resumes, nothing else does."""
    from femflex import run
    from femflex.pipeline import rebuilt
    from femflex.results import open_run

    case = write_case()
    varying = {"hub": swelling_hub(case)}
    whole = run(case, tmp_path / "whole.h5", varying=varying)
    assert whole["bodies/hub/power"].shape == whole.time.shape
    assert whole["bodies/hub/mass"][-1] > whole["bodies/hub/mass"][0]

    def stop(t):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(case, tmp_path / "part.h5", varying=varying, progress=stop)
    with pytest.raises(ValueError, match="bodies that vary with time: hub; now there are: none"):
        run(case, tmp_path / "part.h5", resume=True)
    rest = run(case, tmp_path / "part.h5", varying={"hub": swelling_hub(case)}, resume=True)
    assert np.array_equal(rest["u"], whole["u"]) and np.array_equal(rest["bodies/hub/power"], whole["bodies/hub/power"])
    whole.close(), rest.close()
    with open_run(tmp_path / "whole.h5") as found, pytest.raises(ValueError, match="does not keep the functions"):
        rebuilt(found)


def swelling_hub(case):
    """A hub whose mass and moments grow by a part of a thousand in a second, at the velocity of their places."""
    from femflex.case import read_case
    from femflex.pipeline.decisions import build_system

    body = build_system(read_case(case)).bodies["hub"]
    block = Block(body, ("mass", "growth"))

    def block_numbers(t):
        out, m = np.zeros(block.size), body.moments
        for growth, s in ((False, 1 + 1e-3 * t), (True, 1e-3)):
            block.put_moments(out, MassMoments(s * m.mass, s * m.first, s * m.second), growth)
        return out

    return Variation(polynomial, ("mass", "growth"), fitted(block_numbers, 1))
