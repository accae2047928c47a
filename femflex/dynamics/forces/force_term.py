"""Description of a force term, and the register of all force terms."""

from __future__ import annotations

from abc import abstractmethod
from functools import cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from femflex.arrays import Array
from femflex.dynamics.layout.pool import Pool, Scratch
from femflex.dynamics.layout.records import ENERGY_EFFECTOR, TERM
from femflex.dynamics.report import RowReport, discovered, width
from femflex.kernels.entries import Entry
from femflex.system import Channel, System

Records = NDArray[np.void]


class ForceTerm(RowReport):
    """A kind of force, with any number of items in a system.

    folder    first part of the names of its items in ledger, channels and `without`, as in "loads/thrust"
    energy    ENERGY_*: the monitor to which its stored energy counts
    apply     the calls of signatures APPLY, REPORT, RESIST and RELAX (see `femflex.dynamics.forces.forces`); None for
    report    a term that does not resist a motion, and for one whose items have no states
    resist
    relax
    """

    folder: ClassVar[str]
    energy: ClassVar[int] = ENERGY_EFFECTOR
    apply: ClassVar[Entry]
    report: ClassVar[Entry]
    resist: ClassVar[Entry | None] = None
    relax: ClassVar[Entry | None] = None

    @abstractmethod
    def items(self, system: System) -> list[str]:
        """Names of its items in a system, in the order of the ledger's rows."""

    @abstractmethod
    def lower(self, system: System, head: np.void, bodies: Records, pool: Pool, scratch: Scratch, at: int) -> Any:
        """Return its own records for the table from `at` on; it may change the bodies' records."""

    def channels(self, system: System) -> dict[str, Channel]:
        """Return the channels that `report` writes, in its order: path -> Channel."""
        return {}

    @abstractmethod
    def without_item(self, system: System, item: str) -> System:
        """The system without the item of that name."""

    def fixed(self, system: System) -> list[str]:
        """Names of items that cannot be left out."""
        return []

    def others(self, system: System) -> list[str]:
        """Return names of parts that can be left out and have no row in the ledger."""
        return []

    def breaks(self, system: System) -> list[Array]:
        """Times at which a force is not smooth [s]."""
        return []

    def names(self, system: System) -> list[str]:
        """Full names of its items, as in "loads/thrust"."""
        return [f"{self.folder}/{item}" for item in self.items(system)]

    def record(self, system: System, at: int) -> Records:
        """Its TERM record, its own records standing at a place."""
        record = np.zeros(1, TERM)
        record["apply"], record["report"] = self.apply.address, self.report.address
        record["resist"], record["relax"] = (0 if call is None else call.address for call in (self.resist, self.relax))
        record["at"], record["n"], record["energy"] = at, len(self.items(system)), self.energy
        record["reported"] = sum(width(channel) for channel in self.channels(system).values())
        return record


@cache
def force_terms() -> tuple[ForceTerm, ...]:
    """All force terms, by the names of their files."""
    return discovered(ForceTerm, "femflex.dynamics.forces")
