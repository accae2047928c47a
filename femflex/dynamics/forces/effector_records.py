"""Records of effectors in the table of a model (see femflex.system.effector), and where they read and write."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array, IntArray, Record, Table
from femflex.body import Marker
from femflex.dynamics.bodies.added_mass import MATRIX
from femflex.dynamics.forces.effector_functions import act_address, call_sizes, input_size, output_size
from femflex.dynamics.layout.pool import Pool, Scratch, add_marker
from femflex.dynamics.layout.records import record_reader
from femflex.kernels.lanes import padded
from femflex.system import Effector, System
from femflex.system.orbit import CRAFT_SIGNALS, ORBIT_SIGNALS

EFFECTOR = np.dtype(
    [
        (name, "i8")
        for name in (
            "n_markers", "n_freedoms", "n_inputs", "n_z", "n_channels",
            "act", "jacobian", "add_mass",  # addresses; 0: none
            "pushes",  # whether it may exert forces or torques at markers
            "clears",  # whether its numbers are set to zero before its function is called
            "markers", "freedoms", "inputs",  # table: PORT and HANDLE records, places of inputs from that of z
            "z",  # place of its first state in z
            "parameters", "sizes",  # pool
            "strained",  # body in which it induces strain; 0: none
            "n_strains",  # its components
            "pulls", "stiffens",  # pool: f0 (n_strains, n); table: places (n_strains,) of V1 (n, n) in pool, -1: none
            "before", "after",  # effectors before and after it of its group; -1: none (see `grouped`)
            "seen", "out",  # work: what is seen; what is written, twice
            "pushed",  # work: force (3) and torque (3) of its group up to it, inertial components
            "masses",  # work (n_markers, 6, 6): masses that it adds, inertial components
            "body_mass",  # pool (3 + (6 + n)^2,): place of its first marker, and mass over its body's motion; 0: none
            "trial", "matrix",  # work (n_z,), (n_z, n_z + 1): for Newton's method
        )
    ]
)  # fmt: skip
PORT = np.dtype(
    [
        (name, "i8")
        for name in (
            "body", "place", "shape", "spin", "bends",  # as for marker P of a joint
            "motion",  # work: place from the body's origin, body components (3); tangent T of its own turn (9)
        )
    ]
)  # fmt: skip
HANDLE = np.dtype([(name, "i8") for name in ("body", "freedom", "q", "u")])
N_EFFECTOR, N_PORT, N_HANDLE = (len(record.names or ()) for record in (EFFECTOR, PORT, HANDLE))

effector_at, port_at, handle_at = (record_reader(record) for record in (EFFECTOR, PORT, HANDLE))


Records = NDArray[np.void]
PLACE, CRAFT = 13, 23  # of the place of O, then its velocity, in the state of the orbit; then those of the craft


def lowered(
    effectors: list[Effector], system: System, bodies: Records, head: np.void, pool: Pool, scratch: Scratch, first: int
) -> Table:
    """Return the records of effectors, in that order, for the table from `first` on."""
    records, parts_after = np.zeros(len(effectors), EFFECTOR), []
    position = first + N_EFFECTOR * len(effectors)
    names = [name for name, _ in system.state_names()]
    for record, effector in zip(records, effectors, strict=True):
        lower_effector(record, effector, system, names, pool, scratch)
    ports = [lowered_markers(effector, system, pool, scratch) for effector in effectors]
    share_storage(effectors, records, ports, scratch)
    offsets = signal_offsets(effectors, records, names, int(head["z"]))
    if system.orbit is not None:
        for first_place, signals in ((PLACE, ORBIT_SIGNALS), (CRAFT, CRAFT_SIGNALS)):
            start = int(head["orbit_state"]) + first_place - int(head["z"])
            offsets |= {name: start + k for k, name in enumerate(signals)}
    for record, effector, port in zip(records, effectors, ports, strict=True):
        parts = {
            "markers": port,
            "freedoms": lowered_freedoms(effector, system, bodies),
            "inputs": np.array([offsets[name] for name in effector.inputs], np.int64),
            "stiffens": lowered_strain(record, effector, system, pool),
        }
        for key, part in parts.items():
            record[key] = position
            parts_after.append(part.view(np.int64).ravel())
            position += part.nbytes // 8
    return np.concatenate([records.view(np.int64).ravel(), *parts_after])


def signal_offsets(effectors: list[Effector], records: Records, names: list[str], z: int) -> dict[str, int]:
    """Return the offset of every state and channel of these effectors, from offset z of the work array on."""
    offsets = {
        f"{effector.name}.{channel}": int(r["out"] + 6 * r["n_markers"] + r["n_freedoms"] + r["n_z"]) + k - z
        for effector, r in zip(effectors, records, strict=True)
        for k, channel in enumerate(effector.channels)
    }
    return offsets | {name: k for k, name in enumerate(names)}


def lower_effector(
    record: Record, effector: Effector, system: System, names: list[str], pool: Pool, scratch: Scratch
) -> None:
    """Counts, addresses and places of one effector's own numbers."""
    m, f, n = len(effector.markers), len(effector.freedoms), len(effector.states)
    record["n_markers"], record["n_freedoms"], record["n_inputs"] = m, f, len(effector.inputs)
    record["n_z"], record["n_channels"] = n, len(effector.channels)
    sizes = call_sizes(effector)
    record["act"] = act_address(effector.name, effector.act, sizes)
    if effector.jacobian is not None:
        record["jacobian"] = act_address(effector.name, effector.jacobian, sizes, jacobian=True)
    if effector.added_mass is not None:
        record["add_mass"], record["masses"] = effector.added_mass.address, scratch.take(MATRIX * m)
    if effector.body_mass is not None:
        body, marker = effector.markers[0]
        record["body_mass"] = pool.add(mass_about_origin(effector.body_mass, system.bodies[body].marker(marker)))
    record["z"] = names.index(effector.state_names()[0][0]) if n else 0
    record["parameters"], record["sizes"] = pool.add(effector.parameters), pool.add(effector.sizes)
    record["pushes"] = "force" in effector.exerts or "torque" in effector.exerts
    record["clears"] = not getattr(effector.act, "writes_all", False)
    record["seen"] = scratch.take(input_size(m, f, len(effector.inputs)))
    record["out"] = scratch.take(2 * padded(max(output_size(m, f, n, len(effector.channels)), n * n)))
    record["trial"], record["matrix"] = scratch.take(n), scratch.take(n * (n + 1))


def mass_about_origin(mass: Array, marker: Marker) -> Array:
    """Place (3,) of a marker, then a mass (6 + n, 6 + n) along its axes over the motion of the body's own frame."""
    r, C = marker.position, marker.orientation
    across = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
    J = np.eye(len(mass))
    J[:6, :6] = np.block([[C.T, -C.T @ across], [np.zeros((3, 3)), C.T]])
    return np.concatenate([r, (J.T @ mass @ J).ravel()])


def marker_groups(effectors: list[Effector]) -> list[list[int]]:
    """Groups of effectors whose only marker is the same: its motion is found once, and their forces are added up."""
    groups = defaultdict(list)
    for i, effector in enumerate(effectors):
        if len(effector.markers) == 1 and not effector.freedoms:
            groups[effector.markers[0]].append(i)
    return list(groups.values())


def share_storage(effectors: list[Effector], records: Records, ports: list[Records], scratch: Scratch) -> None:
    """Note the neighbours of each effector in its group, and let a group read and add up at one place."""
    records["before"] = records["after"] = -1
    for group in marker_groups(effectors):
        if len(group) == 1:
            continue
        input_start = scratch.take(input_size(1, 0, max(len(effectors[i].inputs) for i in group)))
        wrench, motion = scratch.take(6), ports[group[0]][0]["motion"]
        for k, i in enumerate(group):
            records[i]["before"] = group[k - 1] if k > 0 else -1
            records[i]["after"] = group[k + 1] if k + 1 < len(group) else -1
            records[i]["seen"], records[i]["pushed"], ports[i][0]["motion"] = input_start, wrench, motion


def lowered_markers(effector: Effector, system: System, pool: Pool, scratch: Scratch) -> Records:
    """PORT records of an effector's markers."""
    records = np.zeros(len(effector.markers), PORT)
    for record, (body, marker) in zip(records, effector.markers, strict=True):
        record["body"], record["motion"] = 1 + system.order.index(body), scratch.take(12)
        entries = add_marker(body, marker, system, pool)
        record["place"], record["shape"], record["spin"], record["bends"] = entries
    return records


def lowered_strain(record: Record, effector: Effector, system: System, pool: Pool) -> IntArray:
    """Places (n_strains,) of the change of stiffness by each component of the strain that an effector induces."""
    if effector.strained is None:
        return np.zeros(0, np.int64)
    body, group = effector.strained
    induced = system.bodies[body].induced[group]
    n = induced.f0.shape[-1]
    f0, V1 = induced.f0.reshape(-1, n), induced.V1.reshape(-1, n, n)
    record["strained"], record["n_strains"] = 1 + system.order.index(body), len(f0)
    record["pulls"] = pool.add(f0.ravel())
    return np.array([pool.add(change.ravel()) if change.any() else -1 for change in V1], np.int64)


def lowered_freedoms(effector: Effector, system: System, bodies: Records) -> Records:
    """HANDLE records of an effector's translations and rotations, whose joints then carry forces."""
    records = np.zeros(len(effector.freedoms), HANDLE)
    for i, name in enumerate(system.order, start=1):
        for k, freedom in enumerate(system.joint_of(name).freedom_names()):
            for record, effector_freedom in zip(records, effector.freedoms, strict=True):
                if freedom == effector_freedom:
                    record["body"], record["freedom"] = i, k
                    record["q"], record["u"] = bodies[i]["q"] + k, bodies[i]["u"] + k
                    bodies[i]["sprung"], bodies[i]["full"] = 1, 0
    return records
