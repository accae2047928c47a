"""Words for small motions: pure ways to move a bar of known points, mixtures of two of them, and rigid motions."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
from scipy.spatial.transform import Rotation

from femflex.body import FlexibleBody, MassMoments, StrainTensors, rigid_body
from femflex.body.skin import Skin
from femflex.dynamics import compile_system
from femflex.dynamics.equilibria.body_motions import body_motions
from femflex.dynamics.equilibria.character import motion_character
from femflex.dynamics.equilibria.rigid_motions import KnownMotion
from femflex.dynamics.equilibria.small_motions import SmallMotions
from femflex.system import Frame, Orbit, System, free, prismatic, spherical, weld

C = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()
LINE = C[:, 0]
SPIN = 2.0 * (0.5 * C[:, 0] + 0.8 * C[:, 1] - 0.3 * C[:, 2])  # neither along the bar nor across it
WAYS = ("flap", "lag", "stretch", "torsion", "chordwise")


def bar() -> tuple[np.ndarray, np.ndarray]:
    """Points (p, 3) of a bar of sections at unequal distances, and five pure ways (5, p, 3) of mean square one."""
    stations, (b, h) = np.array([0.0, 0.7, 1.1, 2.1, 2.9, 3.3, 4.0]), (0.5, 0.2)
    corners = [(b, h), (-b, h), (-b, -h), (b, -h), (0.3 * b, h), (-0.3 * b, -h)]
    local = np.array([[x, y, z] for x in stations for y, z in corners])
    points = local @ C.T + [0.3, -0.2, 0.9]
    flap = SPIN - LINE * (LINE @ SPIN)
    flap /= np.linalg.norm(flap)
    x, y = local[:, 0], local[:, 1]
    arms = local * [0, 1, 1] @ C.T
    twist = np.cross(LINE, arms)
    bent = np.outer(np.tile([1.0, -1.0, 1.0, -1.0, 0.0, 0.0], 7), C[:, 2])  # neither moves a section nor turns it
    bent -= (
        np.outer(np.einsum("pa,pa->p", bent, twist).reshape(7, 6).sum(axis=1).repeat(6), [1, 1, 1])
        * twist
        / (twist**2).reshape(7, 18).sum(axis=1).repeat(6)[:, None]
    )
    shapes = [
        np.outer(x**2, flap),
        np.outer(x**2 - 0.4 * x, np.cross(LINE, flap)),
        np.outer(x, LINE),
        x[:, None] * twist,
        (1.0 + 0.2 * x)[:, None] * bent,
    ]
    assert np.ptp(y) > 0
    return points, np.array([one / np.sqrt((one**2).sum() / len(one)) for one in shapes])


def craft(*others, K=(1.0, 2.0, 3.0, 4.0, 5.0)):
    """The bar, welded, with other bodies on it; its model and the small motions of its coordinates."""
    points, shapes = bar()
    z = np.concatenate([points[:, None], shapes.swapaxes(0, 1)], axis=1)
    dm = np.full(len(points), 0.1)
    moments = MassMoments(dm.sum(), np.einsum("p,pAa->Aa", dm, z), np.einsum("p,pAa,pBb->AaBb", dm, z, z))
    body = FlexibleBody(moments, StrainTensors.linear(np.diag(K)), np.zeros((5, 5)), {}, Skin(points, {}, shapes))
    system = System(
        {"bar": body} | {joint.child: one for joint, one in others}, (weld("bar"), *(joint for joint, _ in others))
    )
    return compile_system(system)


def motions_of(model, shapes, eigenvalues, **more) -> SmallMotions:
    rest = model.at_rest(model.x0[: model.n_q])
    M, n, shapes = model.mass_matrix(0.0, rest), len(eigenvalues), np.asarray(shapes, complex)
    shapes = shapes / np.sqrt(np.einsum("ik,ij,jk->k", shapes.conj(), M, shapes).real)
    values = np.asarray(eigenvalues, complex)
    given = {"known": (), "driven": False, "owners": ("",) * n} | more
    return SmallMotions(
        eigenvalues=values, shapes=shapes, spectrum=values, M=M, rate=0.0, bodies=body_motions(model, rest),
        thresholds=np.zeros(n), spectrum_thresholds=np.zeros(n), **given,
    )  # fmt: skip


def test_pure_ways_and_the_larger_part_of_mixtures_name_a_motion():
    model = craft()
    pairs = list(permutations(range(5), 2))
    phases = np.exp(1j * np.arange(len(pairs)))
    mixed = np.zeros((5, len(pairs)), complex)
    for k, (most, least) in enumerate(pairs):
        mixed[most, k], mixed[least, k] = 1.0, 0.9 * phases[k]
    shapes = np.hstack([np.eye(5), mixed])
    found = motions_of(model, shapes, 1j * np.arange(1.0, 1.0 + shapes.shape[1]))
    words = [*range(5), *(most for most, _ in pairs)]
    assert motion_character(model, found, SPIN).words == tuple(WAYS[k] for k in words)
    still = motion_character(model, found).words
    assert still[:5] == ("bending", "bending", "stretch", "torsion", "chordwise")


def test_without_a_spin_flap_and_lag_together_are_bending():
    model = craft()
    shapes = np.array([[0.8, 0.8, 0.0, 1.0, 0.0], [0.6, 0.6, 0.0, 1.0, 0.0], [0.8, 0.8, 1.0, 0.0, 1.1]]).T
    found = motions_of(model, shapes, 1j * np.arange(1.0, 4.0))
    assert motion_character(model, found).words == ("bending", "torsion", "bending")
    assert motion_character(model, found, SPIN).words == ("torsion", "torsion", "chordwise")


def test_rigid_bodies_count_only_where_no_strain_resists():
    """A heavy rigid box is carried along the lag of the bar's flap; it slides in another motion."""
    flap = SPIN - LINE * (LINE @ SPIN)
    aside = np.cross(LINE, flap / np.linalg.norm(flap))
    box = rigid_body(50.0, C @ np.diag([0.5, 2.0, 2.2]) @ C.T)  # as long along the bar's line
    model = craft((prismatic("box", "bar", axis=aside), box), K=np.full(5, 4.0))
    names = [name for name, _ in model.system.velocity_names()]
    slide = names.index("bar-box.slide_rate")
    deltas = [k for k in range(6) if k != slide]
    shapes = np.zeros((6, 3))
    shapes[deltas[0]] = [1.0, 1.0, 0.0]
    shapes[slide] = [0.4, 0.4, 0.2]
    found = motions_of(model, shapes, [0.5j, 20j, 0.5j])  # strain 4 over a mass of 12.2: 0.33 of 0.25, and of 400
    assert motion_character(model, found, SPIN).words == ("flap", "lag", "lag")
    assert motion_character(model, found).words == ("bending", "joint", "joint")
    shares = motion_character(model, found).energy
    M = found.M
    total = np.einsum("uk,uv,vk->k", shapes, M, shapes)
    np.testing.assert_allclose(shares["box"], 50.0 * shapes[slide] ** 2 / total, rtol=1e-6)
    np.testing.assert_allclose(shares["box"] + shares["bar"], 1.0)
    owned = replace(found, owners=("lag.x", "", ""))
    assert motion_character(model, owned, SPIN).words == ("lag.x", "lag", "lag")


INERTIA = C @ np.diag([2.0, 3.0, 4.5]) @ C.T


def rigid_craft(joint, **more):
    """A rigid body with its centre away from its origin."""
    return compile_system(System({"a": rigid_body(3.0, INERTIA, [0.1, -0.2, 0.15])}, (joint,), **more))


def test_turns_in_orbit_are_the_librations_of_their_axes():
    model = rigid_craft(spherical("a"), orbit=Orbit(7e6), frame=Frame("orbital"))
    shapes = np.array([[1.0, 0.3, 0.2j], [0.2, 1.0, 0.3], [0.3j, -0.2, 1.0]])
    about = motions_of(model, shapes, 1e-3j * np.arange(1.0, 4.0))
    assert motion_character(model, about).words == ("libration pitch", "libration yaw", "libration roll")


def test_of_a_free_spin_the_motion_that_turns_the_craft_most_is_its_wobble():
    model = craft(K=np.full(5, 1e-3))
    body, spin = model.system.bodies["bar"], Frame("spinning", SPIN)
    model = compile_system(System({"bar": body}, (free("bar"),), frame=spin))
    shapes = np.zeros((11, 3))
    shapes[10, 0], shapes[3:6, 1], shapes[9, 2] = 1.0, [0.5, -0.2, 0.4], 1.0
    tilt = KnownMotion("tilt of the spin axis", 2j, False, np.zeros(11, complex))
    about = motions_of(model, shapes, [0.01j, 1.3j, 0.01j], known=(tilt,))
    assert motion_character(model, about, SPIN).words == ("chordwise", "wobble", "torsion")
    alone = motions_of(model, shapes[:, :1], [0.01j], known=(tilt,))
    assert motion_character(model, alone, SPIN).words == ("chordwise",)


def test_motions_of_a_whole_craft_are_named_by_the_rigid_motion_that_is_most_of_them():
    model = rigid_craft(free("a"))
    centre = np.array([0.1, -0.2, 0.15])
    shapes = np.zeros((6, 6))
    for k, axis in enumerate(np.eye(3)):
        shapes[:3, k] = axis + 0.2
        shapes[3:, 3 + k] = axis + 0.1
        shapes[:3, 3 + k] = -np.cross(axis + 0.1, centre) + 0.02  # about the centre of mass
    about = motions_of(model, shapes, 1j * np.arange(1.0, 7.0))
    names = tuple(f"{kind} {axis}" for kind in ("translation", "rotation") for axis in "xyz")
    assert motion_character(model, about).words == names
    held = rigid_craft(spherical("a"))
    turns = np.eye(3) + 0.2
    undriven, driven = (motions_of(held, turns, 1j * np.arange(1.0, 4.0), driven=flag) for flag in (False, True))
    assert motion_character(held, driven).words == ("rotation x", "rotation y", "rotation z")
    assert motion_character(held, undriven).words == ("joint",) * 3
