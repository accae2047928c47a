"""Shapes that follow, against the same shapes as coordinates: members of trees, frames, plates, free or driven."""

from __future__ import annotations

import numpy as np
import pytest

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.fem import Material, Member, build_structure
from femflex.fem.sections import StiffnessSection
from femflex.integrate import integrator
from femflex.mesh import line, rectangle
from femflex.reduction import (
    cantilever_modes,
    craig_bampton,
    free_free_modes,
    reduce_structure,
    with_derivatives,
)
from femflex.system import Load, Profile, System, free, revolute, weld

SLIM = StiffnessSection(1e6, 40.0, 70.0, 30.0, 0.5, ry=6e-3, rz=8e-3)
TIMES = np.linspace(0.0, 4.0, 41)


def boom():
    return build_structure(line([[0, 0, 0], [4.0, 0, 0]], 8), [Member("line", "beam", SLIM)])


def frame():
    return build_structure(line([[0, 0, 0], [2.0, 0, 0], [2.0, 1.0, 0]], 6), [Member("line", "beam", SLIM)])


def plate():
    metal = Material(7e10, 0.3, 2700.0)
    return build_structure(rectangle(2.0, 0.5, 6, 2, "quad"), [Member("surface", "plate_bfs", 2e-3, metal)])


def driven(body, near, far):
    """A body that a shaft about z spins up until it bends by a sixth of its length, a lump welded to its other end."""
    lump = rigid_body(0.4, 0.01 * np.eye(3), markers={"origin": Marker.rigid(np.zeros(3))})
    turn = Profile.smooth_step(0.0, 4.0, 0.0, 0.42)
    joints = (
        revolute("body", axis=(0, 0.2, 1.0), motion=(turn,), child_marker=near),
        weld("lump", parent="body", parent_marker=far),
    )
    return System({"body": body, "lump": lump}, joints)


def floating(body, near, far):
    """A free body spun up by opposite forces at its ends that turn with it."""
    times = np.array([0.0, 1.5, 3.0])
    push = np.array([[0.0, 0, 0], [0.0, 3.0, 0.6], [0.0, 0, 0]])
    loads = [Load("a", "body", near, force=-push, times=times), Load("b", "body", far, force=push, times=times)]
    return System({"body": body}, (free("body"),), tuple(loads))


MADE = {
    "boom that floats": (boom, lambda s: free_free_modes(s, 4), floating, ("start", "end")),
    "plate that floats": (plate, lambda s: free_free_modes(s, 4), floating, ("left", "right")),
    "boom in a tree": (boom, lambda s: craig_bampton(s, ("start", "end"), 2), driven, ("start", "end")),
    "plate in a tree": (plate, lambda s: craig_bampton(s, ("left", "right"), 1), driven, ("left", "right")),
    "frame in a tree": (frame, lambda s: craig_bampton(s, ("start", "end"), 2), driven, ("start", "end")),
    "frame on a shaft": (frame, lambda s: cantilever_modes(s, "start", 6), driven, ("start", "end")),
}


def end(name, strain, keep="auto"):
    """Deflection of the far end (n_t, 3)."""
    make, shapes, system, (near, far) = MADE[name]
    structure = make()
    modes = shapes(structure)
    if strain != "linear":
        modes = with_derivatives(structure, modes, keep)
    body = reduce_structure(structure, modes, {near: near, far: far}, strain=strain)
    model = compile_system(system(body, near, far))
    run = integrator("esdirk4", rtol=1e-6, atol=1e-8).solve(model, TIMES, model.x0)
    return model.observe(TIMES, run.states)[f"markers/body.{far}/deflection"]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", MADE)
def test_what_follows_moves_as_what_is_a_coordinate(name):
    tips = {strain: end(name, strain) for strain in ("linear", "condensed", "nonlinear")}
    size = np.abs(tips["nonlinear"]).max()
    off = {s: np.abs(tips[s] - tips["nonlinear"]).max() / size for s in tips}
    # what follows has the coupling of both bends with twist to third order, coordinates to fourth
    assert off["condensed"] < 3e-3 and off["linear"] > 5e-3
