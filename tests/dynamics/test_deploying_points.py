"""Members that deploy from a flexible parent, with payloads on their tips, against Kane's equations of points."""

from dataclasses import replace

import numpy as np
import pytest
from support.pointwise import Jet, Tree, equations, partial_velocities
from support.random_systems import random_body, random_state
from support.random_table import elastic_forces

from femflex.deployment import DeployingLine, deploying_line
from femflex.deployment.series import derivative, evaluate
from femflex.dynamics import compile_system
from femflex.reduction import BeamFunctions
from femflex.reduction.beams.beam_functions import gauss
from femflex.system import Profile, System, free, revolute, weld

NOW = 0.7


class Amplitudes(dict):
    """Jets of all shapes of each body, from those of its coordinates: slaved ones follow."""

    def __init__(self, system):
        super().__init__()
        self.system = system

    def __setitem__(self, name, d):
        parts = [(d.v, d.d, d.dd)]
        for A in self.system.bodies[name].slaves:
            parts.append(([d.v @ A @ d.v / 2], [d.v @ A @ d.d], [d.d @ A @ d.d + d.v @ A @ d.dd]))
        super().__setitem__(name, Jet(*(np.concatenate(part) for part in zip(*parts, strict=True))))


class DeployingTree(Tree):
    """Points some of which move by themselves, with shapes that follow others."""

    def __init__(self, system, clouds, markers):
        super().__init__(system, clouds)
        self.delta, self.own = Amplitudes(system), markers

    def marker(self, marker, delta):
        return Tree.marker(self.own.get(id(marker), marker), delta)


def material(made, length, total, at_tip):
    """(mass, jets of rho, jets of phi) of a member's deployed and stowed points, and the flux at each over m' U^2."""
    L, U, A = (float(v) for v in length(NOW))
    L0, shapes = made.parts.reference, made.shapes
    ratio, rate, acceleration = L / L0, U / L0, A / L0
    xi, weight = gauss(24)
    mass, rho, phi, flux = [], [], [], []
    drum = np.array([1.0 if at_tip else 0.0])
    per_length = made.shapes.member_mass / L0
    for places, moves, m in (
        (shapes.material_points(xi, weight), True, per_length * L),
        (shapes.material_points(drum, np.ones(1)), False, total - per_length * L),
    ):
        eps = 1e-4

        def value(r, x, places=places):  # z of the material points at the ratio r, xi as it moves
            again = shapes.material_points(x, np.ones(len(x)))
            return evaluate(again.values, r)

        def path(s, places=places, moves=moves):
            """z at the ratio ratio + s of the points that are at places.xi now."""
            r = ratio + s
            sections = len(shapes.line.sections[1])
            x = places.xi[::sections]
            if moves:
                x = x * ratio / r if at_tip else 1.0 - (1.0 - x) * ratio / r
            return value(r, x)

        z = path(0.0)
        first = (8 * (path(eps) - path(-eps)) - (path(2 * eps) - path(-2 * eps))) / (12 * eps)
        second = (16 * (path(eps) + path(-eps)) - (path(2 * eps) + path(-2 * eps)) - 30 * z) / (12 * eps**2)
        if not moves and not at_tip:
            first, second = 0 * first, 0 * second
        dz, ddz = rate * first, acceleration * first + rate**2 * second
        mass += list(m * places.share)
        rho += [Jet(z[p, :, 0], dz[p, :, 0], ddz[p, :, 0]) for p in range(len(z))]
        phi += [Jet(z[p, :, 1:], dz[p, :, 1:], ddz[p, :, 1:]) for p in range(len(z))]
        if moves:
            flux += [np.zeros((3, 1 + z.shape[2] - 1))] * len(z)
        else:
            jump = evaluate(places.velocities(at_tip), ratio) * rate - dz  # of what leaves the drum
            flux += [per_length * U * s * j for s, j in zip(places.share, jump, strict=True)]
    return (mass, rho, phi), flux


def moving_marker(made, name, length):
    L, U, A = (float(v) for v in length(NOW))
    L0, marker = made.parts.reference, made.parts.markers[name]

    def jet(series):
        first = derivative(series)
        rate, slope, bend = (evaluate(s, L / L0) if s else 0.0 for s in (series, first, derivative(first)))
        return Jet(rate, U / L0 * slope + 0 * rate, A / L0 * slope + (U / L0) ** 2 * bend + 0 * rate)

    return jet(marker.position), jet(marker.phi), jet(marker.psi)


def frozen_jet(jet):
    return Jet(jet.v)


@pytest.mark.sampled(1)
@pytest.mark.parametrize(("seed", "drum"), [(1, "root"), pytest.param(2, "root", marks=pytest.mark.slow), (3, "tip")])
def test_deploying_members_on_flexible_parent_match_kane(seed, drum):
    rng = np.random.default_rng(seed)
    bodies, clouds, joints, varying, markers, flux = {}, {}, [free("parent")], {}, {}, []
    bodies["parent"], clouds["parent"] = random_body(rng, 2)
    flux += [np.zeros((3, 3))] * len(clouds["parent"][0])
    fluxes = {"parent": flux}
    for k, mount in enumerate("ab"):
        name = f"arm_{mount}"
        line = DeployingLine(
            mass_per_length=rng.uniform(0.5, 1.5), EIy=rng.uniform(1, 3), EIz=rng.uniform(1, 3), GJ=1.0, ry=0.1,
            rz=0.15, rotary_inertia=True, root=rng.normal(size=3), direction=rng.normal(size=3),
        )  # fmt: skip
        length = Profile.polynomial(1.0 + k, *rng.uniform(-0.5, 0.5, 2))
        functions = BeamFunctions(y=2, z=1, torsion=1, axial=k, family="polynomial")
        line = line.model_copy(update={"EA": 2.0})
        made = deploying_line(line, functions, length, until=1.0, stock=4.0, drum=drum)
        total = line.mass_per_length * 4.0
        bodies[name], varying[name] = made.body, made.variation
        clouds[name], fluxes[name] = material(made, length, total, drum == "tip")
        markers[made.body.marker("tip")] = moving_marker(made, "tip", length)
        joints.append(weld(name, "parent", parent_marker=mount, child_marker="root"))
        load = f"payload_{mount}"
        bodies[load], clouds[load] = random_body(rng, k)
        fluxes[load] = [np.zeros((3, 1 + k))] * len(clouds[load][0])
        joints.append(revolute(load, name, parent_marker="tip", child_marker="c", axis=rng.normal(size=3)))
    system = System(bodies, tuple(joints), varying=varying)
    q, u = random_state(system, rng)
    scale = np.array([0.02 if ".delta" in name and "arm" in name else 1.0 for name, _ in system.coordinate_names()])
    q = q * scale
    model = compile_system(system)
    udot = rng.normal(size=model.n_u)
    ours = model.residual(NOW, np.concatenate([q, u]), udot)

    def markers_of_body(moves):
        keep = (lambda jet: jet) if moves else frozen_jet
        return {
            id(marker): replace(marker, position=keep(p), phi=keep(f), psi=keep(s))
            for marker, (p, f, s) in markers.items()
        }

    resting = {
        name: (
            m,
            [frozen_jet(x) if isinstance(x, Jet) else x for x in r],
            [frozen_jet(f) if isinstance(f, Jet) else f for f in p],
        )
        for name, (m, r, p) in clouds.items()
    }
    base = lambda moves: Jet(np.eye(3))  # noqa: E731
    partial = partial_velocities(DeployingTree(system, resting, markers_of_body(False)), q, len(u), base)
    tree = DeployingTree(system, clouds, markers_of_body(True))

    def pushes(m, r):
        out = []
        for name in system.order:
            y = np.concatenate([[1.0], tree.delta[name].v])
            out += [-(tree.frames[name][0].v @ (f @ y)) for f in fluxes[name]]
        return np.array(out)

    theirs = equations(tree, q, u, udot, base, pushes, partial=partial)
    x = np.concatenate([q, u])
    still_stiff = replace(system, bodies={name: made_at(model, name, body) for name, body in bodies.items()})
    theirs = theirs + elastic_forces(still_stiff, q, u)
    assert ours == pytest.approx(theirs, rel=1e-8, abs=1e-9 * np.abs(theirs).max(initial=1))
    found = model.state_rate(NOW, x)[model.n_q :]
    assert model.residual(NOW, x, found) == pytest.approx(np.zeros(model.n_u), abs=1e-9 * np.abs(ours).max())


def made_at(model, name, body):
    """The body with its stiffness at NOW; the quartic energy of its curvature goes with the length to the power -5."""
    if name not in model.system.varying:
        return body
    table, block = model.system.varying[name].write, None
    from femflex.system import Block

    block = Block(body, model.system.varying[name].varies)
    numbers = table.block_at(*(float(v) for v in table.length(NOW)))
    n, row = body.n_modes, block.row
    V1 = numbers[block.stiffness : block.stiffness + n * row].reshape(n, row)[:, :n]
    growth = float(table.length(NOW)[0] / table.length(0.0)[0])
    return replace(body, strain=replace(body.strain, V1=V1, V3=body.strain.V3 / growth**5))
