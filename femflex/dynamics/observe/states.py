"""The state of a run: coordinates, quasi-velocities and states z, and the parts of bodies and effectors in it."""

from __future__ import annotations

from collections.abc import Iterator

from femflex.arrays import Array
from femflex.dynamics.joints.places import joint_places
from femflex.dynamics.report import Observation, Report
from femflex.system import Channel, Controller, Effector, System


class States(Report):
    """Vectors of the state, amplitudes of the shapes of bodies, and states of effectors and controllers."""

    def channels(self, system: System) -> dict[str, Channel]:
        out = {}
        for path, text, pairs in (
            ("q", "coordinates", system.coordinate_names()),
            ("u", "quasi-velocities", system.velocity_names()),
            ("z", "states of latches, effectors and controllers", system.state_names()),
        ):
            names, units = tuple(name for name, _ in pairs), ", ".join(unit for _, unit in pairs)
            out[path] = Channel(units, text, (len(pairs),), names, reported=path != "z" or bool(pairs))
        for name in system.order:
            n = system.bodies[name].n_shapes
            meaning = f"amplitudes of the shapes of {name}"
            out[f"bodies/{name}/delta"] = Channel("kg^1/2 m", meaning, (n,), reported=n > 0)
        for effector in system.effectors:
            sampling = ""
            if isinstance(effector, Controller):
                sampling = f", sampled every {effector.period:g} s (zero-order hold)"
            for name, unit in reported_states(effector):
                state = name.removeprefix(effector.name + ".")
                out[f"effectors/{effector.name}/{state}"] = Channel(unit, f"state {state} of {effector.name}{sampling}")
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        yield from (seen.q, seen.u, seen.z)
        for joint, iq, _ in joint_places(seen.system):
            body, first = seen.system.bodies[joint.child], iq + joint.n_q
            yield body.amplitudes(seen.q[:, first : first + body.n_modes])
        columns = {name: k for k, (name, _) in enumerate(seen.system.state_names())}
        for effector in seen.system.effectors:
            yield from (seen.z[:, columns[name]] for name, _ in reported_states(effector))


def reported_states(effector: Effector | Controller) -> list[tuple[str, str]]:
    """Full name and unit of the states that have a channel of their own."""
    left_out = set(effector.memory_names()) if isinstance(effector, Controller) and effector.follows else set()
    return [pair for pair in effector.state_names() if pair[0] not in left_out]
