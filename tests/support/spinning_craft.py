"""Random craft of a hub and booms, free ones turned at random in body axes, and the principal axes of the whole."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from femflex.body import Marker, rigid_body
from femflex.dynamics import compile_system
from femflex.reduction import BeamFunctions, Damping, UniformBeam, beam_body
from femflex.system import System, free, weld


def random_craft(seed: int, driven: bool = False, damping: float = 0.0):
    """A craft and an axis to spin about: any where the hub is driven, else a principal axis of the undeformed craft."""
    rng = np.random.default_rng(seed)
    booms, joints, seats = {}, [], {}
    for k in range(int(rng.integers(2, 4))):
        along = rng.normal(size=3)
        along /= np.linalg.norm(along)
        up = np.cross(along, rng.normal(size=3))
        up /= np.linalg.norm(up)
        seats[f"seat{k}"] = Marker.at_position(0.4 * along, np.column_stack([along, up, np.cross(along, up)]))
        EIy, EIz = rng.uniform(20, 200, 2)
        beam = UniformBeam(rng.uniform(1.5, 3), 1e5, EIy, EIz, rng.uniform(5, 50), rng.uniform(0.3, 1.0), 0.05, 0.04)
        ratio = Damping(damping) if damping else None
        functions = BeamFunctions(y=3, z=3, torsion=1, family="polynomial")
        booms[f"boom{k}"] = beam_body(beam, functions, ratio, strain="condensed")
        joints.append(weld(f"boom{k}", "hub", parent_marker=f"seat{k}", child_marker="root"))
    inertia = np.sort(rng.uniform(5, 40, 3))
    inertia[2] = min(inertia[2], 0.95 * (inertia[0] + inertia[1]))
    C = Rotation.random(random_state=seed).as_matrix()
    hub = rigid_body(rng.uniform(30, 80), C @ np.diag(inertia) @ C.T, markers=seats)
    root = weld("hub") if driven else free("hub")
    system = System({"hub": hub, **booms}, (root, *joints))
    if driven:
        axis = rng.normal(size=3)
        return system, axis / np.linalg.norm(axis)
    return system, principal_axes(system)[:, int(rng.integers(0, 3))]


def principal_axes(system: System):
    """Principal axes (3, 3) about the centre of mass of a craft on a free root, by rising inertia."""
    model = compile_system(system)
    M = model.mass_matrix(0.0, np.concatenate([model.x0[: model.n_q], np.zeros(model.n_u)]))
    coupling = M[3:6, :3] / M[0, 0]
    return np.linalg.eigh(M[3:6, 3:6] - M[0, 0] * coupling @ coupling.T)[1]
