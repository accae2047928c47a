"""Runs to draw, made by hand: a box with a tube boom and a thin panel, tumbling, or librating in an orbit."""

from __future__ import annotations

import numpy as np

from femflex.body import FlexibleBody, Marker, MassMoments, Skin, StrainTensors, rigid_body
from femflex.results import RunWriter
from femflex.system import Channel

BOOM, PANEL = 12.0, (6.0, 2.4)  # m
ROOTS = np.array([1.8751040687, 4.6940911330, 7.8547574382])  # of cos x cosh x = -1
XYZ = ("x", "y", "z")


def clamped_free(s, k):
    """Bending shape k of a clamped-free beam at s in [0, 1], unit at the tip, and its slope."""
    b = ROOTS[k]
    ratio = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
    shape = np.cosh(b * s) - np.cos(b * s) - ratio * (np.sinh(b * s) - np.sin(b * s))
    slope = b * (np.sinh(b * s) + np.sin(b * s) - ratio * (np.cosh(b * s) - np.cos(b * s)))
    tip = np.cosh(b) - np.cos(b) - ratio * (np.sinh(b) - np.sin(b))
    return shape / tip, slope / tip


def box_skin(x, y, z):
    """A closed box of those edges [m] about the origin."""
    points = np.array([[i, j, k] for i in (-x / 2, x / 2) for j in (-y / 2, y / 2) for k in (-z / 2, z / 2)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return Skin(points, {"quad": np.array(quads)}, np.zeros((0, 8, 3)))


def tube_skin(length=BOOM, radius=0.12, stations=60, sides=16):
    """A tube along x with two bending shapes in y and two in z, closed at its ends; each element has its own points."""
    s = np.linspace(0, 1, stations + 1)
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1) * radius
    s = np.stack([s[:-1], s[1:]], axis=1).ravel()  # two rings for every element, shared by none
    points = (s[:, None, None] * [length, 0, 0] + ring).reshape(-1, 3)
    number = np.arange(len(points)).reshape(stations, 2, sides)
    around = np.roll(number, -1, axis=2)
    quads = np.stack([number[:, 0], number[:, 1], around[:, 1], around[:, 0]], axis=-1).reshape(-1, 4)[:, ::-1]
    fan = np.stack([np.zeros(sides - 2, int), np.arange(1, sides - 1), np.arange(2, sides)], axis=1)
    caps = np.concatenate([number[0, 0][fan][:, ::-1], number[-1, 1][fan]])
    shapes = []
    for k in (0, 1):
        w, slope = clamped_free(s, k)
        for axis in (1, 2):
            u = np.zeros((len(s), sides, 3))
            u[..., axis] = w[:, None]
            u[..., 0] = -slope[:, None] / length * ring[:, axis]  # plane sections turn
            shapes.append(u.reshape(-1, 3))
    return Skin(points, {"quad": quads, "triangle": caps}, np.array(shapes))


def panel_skin(length=PANEL[0], width=PANEL[1], thickness=0.03, n=(40, 16)):
    """A thin plate along y, clamped at y = 0, with bending and twisting shapes; both faces and the rim."""
    y, x = np.meshgrid(np.linspace(0, 1, n[0] + 1), np.linspace(-0.5, 0.5, n[1] + 1), indexing="ij")
    middle = np.stack([x * width, y * length, 0 * x], axis=-1)
    number = np.arange(x.size).reshape(x.shape)
    top, bottom = number, number + x.size
    quad = lambda a: np.stack([a[:-1, :-1], a[:-1, 1:], a[1:, 1:], a[1:, :-1]], axis=-1).reshape(-1, 4)  # noqa: E731
    rim = [(a[i], b[i]) for a, b, i in [(top, bottom, 0), (bottom, top, -1)]]
    rim += [(a[:, i], b[:, i]) for a, b, i in [(bottom, top, 0), (top, bottom, -1)]]
    walls = [np.stack([a[:-1], a[1:], b[1:], b[:-1]], axis=-1) for a, b in rim]
    half = np.array([0, 0, thickness / 2])
    points = np.concatenate([(middle + half).reshape(-1, 3), (middle - half).reshape(-1, 3)])
    deflections = [clamped_free(y, 0)[0], clamped_free(y, 0)[0] * 2 * x, clamped_free(y, 1)[0]]
    shapes = np.zeros((3, len(points), 3))
    shapes[:, :, 2] = [np.tile(w.ravel(), 2) for w in deflections]
    return Skin(points, {"quad": np.concatenate([quad(top), quad(bottom)[:, ::-1], *walls])}, shapes)


def flexible(skin, omega, markers):
    """A body that carries a skin; its mass moments do not matter to a picture."""
    n = len(skin.shapes)
    moments = MassMoments(20.0, np.zeros((1 + n, 3)), np.einsum("AB,ab->AaBb", np.eye(1 + n), np.eye(3)))
    places = {name: Marker(skin.points[k], skin.shapes[:, k].T.copy(), np.zeros((3, n))) for name, k in markers.items()}
    stiffness = StrainTensors.linear(np.diag(np.square(omega)))
    return FlexibleBody(moments, stiffness, np.zeros((n, n)), places, skin, ("vibration",) * n, np.array(omega))


def craft():
    boom, panel = tube_skin(), panel_skin()
    tip, corner = len(boom.points) - 1, int(np.argmax(panel.points @ [1, 1, 1]))
    return {
        "hub": rigid_body(500.0, 200 * np.eye(3), skin=box_skin(1.6, 1.6, 2.2)),
        "boom": flexible(boom, 2 * np.pi * np.array([0.35, 0.36, 2.19, 2.26]), {"tip": tip}),
        "panel": flexible(panel, 2 * np.pi * np.array([0.8, 2.1, 5.0]), {"corner": corner}),
    }


def quaternions(axis, angle):
    """Euler parameters (n_t, 4) of turns about an axis."""
    unit = np.asarray(axis, float) / np.linalg.norm(axis)
    return np.column_stack([np.cos(angle / 2), np.sin(angle / 2)[:, None] * unit])


def product(a, b):
    w, x, y, z = a.T
    left = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    return np.einsum("ijt,tj->ti", left, b)


def rotated(e, r):
    w, v = e[:, :1], e[:, 1:]
    return r + 2 * np.cross(v, np.cross(v, np.broadcast_to(r, v.shape)) + w * r)


def run_arrays(times, bodies, orbital):
    """Channels of a made-up motion: the hub tumbles, or librates about the orbital axes; the rest vibrates on it."""
    if orbital:
        # C_NO: x0 along Z (normal), y0 outward, z0 along the flight, at true anomaly f
        f = 2 * np.pi * times / 5400
        orbit = product(quaternions([0, 0, 1], f), np.tile([0.5, -0.5, -0.5, -0.5], (len(times), 1)))
        angles = np.deg2rad(np.column_stack([25 * np.cos(3 * f), 8 * np.sin(3.6 * f), 5 * np.sin(2 * f + 1)]))
        libration = [quaternions(axis, a) for axis, a in zip(np.eye(3)[[0, 2, 1]], angles.T, strict=True)]
        hub = product(orbit, product(libration[0], product(libration[1], libration[2])))
        slow = 60.0
    else:
        hub, slow = quaternions([0.3, 1, 0.2], 0.25 * times), 1.0
        angles = np.column_stack([0.25 * times, 0.02 * times, 0.05 * np.sin(times)])
    omega = np.concatenate([bodies["boom"].omega, bodies["panel"].omega]) / slow
    delta = np.cos(times[:, None] * omega + np.arange(7)) * [0.9, 0.5, 0.12, 0.08, 0.25, 0.15, 0.05]
    out = {"attitude/angles": angles, "monitors/energy": 12.5 * (1 + 3e-11 * np.sin(times / 3) * times)}
    mount = {"hub": np.zeros(3), "boom": np.array([0.8, 0.0, 0.0]), "panel": np.array([0.0, 0.8, 0.0])}
    for name, place in mount.items():
        out[f"bodies/{name}/position"] = rotated(hub, place)
        out[f"bodies/{name}/attitude"] = hub
    out |= {"bodies/boom/delta": delta[:, :4], "bodies/panel/delta": delta[:, 4:], "bodies/hub/delta": delta[:, :0]}
    for body, marker in (("boom", "tip"), ("panel", "corner")):
        place = bodies[body].markers[marker]
        u = out[f"bodies/{body}/delta"] @ place.phi.T
        out[f"markers/{body}.{marker}/deflection"] = u
        out[f"markers/{body}.{marker}/position"] = rotated(hub, mount[body] + place.position + u)
    if orbital:
        out["orbit/attitude"] = orbit
    return out


def channel(path, value):
    kind = path.split("/")[-1]
    if kind == "attitude" or kind == "angles":
        names = ("e0", "e1", "e2", "e3") if kind == "attitude" else ("pitch", "yaw", "roll")
        return Channel("1" if kind == "attitude" else "rad", kind, value.shape[1:], names)
    unit = {"delta": "kg^1/2 m", "energy": "J"}.get(kind, "m")
    return Channel(unit, kind, value.shape[1:], XYZ if value.shape[1:] == (3,) and kind != "delta" else ())


def write_run(path, times, orbital=False, bodies=None, title="A box with a boom and a panel"):
    bodies = craft() if bodies is None else bodies
    arrays = run_arrays(times, bodies, orbital)
    channels = {name: channel(name, value) for name, value in arrays.items()}
    with RunWriter(path, channels, bodies, {"title": title}) as writer:
        writer.write_block(times, arrays)
        writer.finish(complete=True)
    return path
