"""A small run whose every number is a known function of time."""

from __future__ import annotations

import numpy as np

from femflex.body import FlexibleBody, Marker, MassMoments, Skin, StrainTensors, rigid_body
from femflex.results import RunWriter
from femflex.system import Channel

CHANNELS = {
    "q": Channel("rad, kg^1/2 m", "coordinates", (2,), ("joint.angle", "boom.delta1")),
    "bodies/hub/position": Channel("m", "place of the body frame", (3,), ("x", "y", "z"), "inertial"),
    "bodies/boom/delta": Channel("kg^1/2 m", "elastic coordinates", (1,), ("delta1",)),
    "attitude/angles": Channel("rad", "attitude of the root body", (3,), ("pitch", "yaw", "roll")),
    "monitors/energy": Channel("J", "total energy"),
}


def known_arrays(times):
    """Values of every channel at those instants."""
    columns = np.stack([np.sin(times), np.cos(times), times**2], axis=1)
    return {
        "q": columns[:, :2],
        "bodies/hub/position": columns.copy(),
        "bodies/boom/delta": columns[:, 1:2],
        "attitude/angles": columns / 3,
        "monitors/energy": 1 / (1 + times),
    }


def known_bodies():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    skin = Skin(points, {"triangle": np.array([[0, 1, 2]])}, np.array([[[0.0, 0, 0], [0, 0, 1], [0, 0, 2]]]))
    moments = MassMoments(2.0, np.zeros((2, 3)), np.einsum("AB,ab->AaBb", np.eye(2), np.eye(3)))
    tip = Marker(np.array([0.0, 1, 0]), np.array([[0.0], [0], [2]]), np.zeros((3, 1)))
    boom = FlexibleBody(
        moments,
        StrainTensors.linear(np.eye(1)),
        np.zeros((1, 1)),
        {"tip": tip},
        skin,
        kinds=("vibration",),
        omega=np.array([6.5]),
    )
    return {"hub": rigid_body(3.0, np.eye(3)), "boom": boom}


def write_known_run(path):
    """A finished run of five blocks of seven instants, with everything a run can have; its path."""
    attributes = {"title": "a known run", "case_text": "[run]\nduration = 3.4\n", "rtol": 1e-9}
    with RunWriter(path, CHANNELS, known_bodies(), attributes, force=True) as writer:
        for k in range(5):
            times = 0.1 * np.arange(7 * k, 7 * k + 7)
            writer.write_block(times, known_arrays(times), resume={"x": np.array([k, k / 3]), "steps": k})
        writer.finish(complete=True, ended="reached the end", statistics={"steps": 41, "h_mean": 0.08})
    return path
