"""State of latches: whether and when they closed, and the energy that this took."""

from __future__ import annotations

from collections.abc import Iterator

from femflex.arrays import Array
from femflex.dynamics.joints.law_places import latch_places
from femflex.dynamics.reports.report import Observation, Report
from femflex.system import Channel, System


class Latches(Report):
    """Every latch, per body in tree order."""

    def channels(self, system: System) -> dict[str, Channel]:
        out = {}
        for place in latch_places(system):
            name = place.joint.freedom_names()[place.latch.freedom]
            out[f"latches/{name}/locked"] = Channel("1", f"1 from when {name} latched")
            out[f"latches/{name}/time"] = Channel("s", f"when {name} latched; -1 before; -2 - t once released at t")
            out[f"latches/{name}/loss"] = Channel("J", f"energy lost when {name} latched")
        return out

    def observe(self, seen: Observation) -> Iterator[Array]:
        for place in latch_places(seen.system):
            time, loss = seen.z[:, place.time], seen.z[:, place.time + 1]
            yield from ((time >= 0).astype(float), time, loss)
