"""Description of a report, the register of all reports, and the observation of a model by them."""

from __future__ import annotations

import pkgutil
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from inspect import isabstract
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.joints.places import prescribed_states
from femflex.dynamics.observe.observe import observe
from femflex.system import Channel, System

if TYPE_CHECKING:
    from femflex.dynamics.model import Model


class Report(ABC):
    """Channels of one subject, and their values.

    place    among the reports of a run; those of one place go by the names of their files
    """

    place: ClassVar[int] = 4

    @abstractmethod
    def channels(self, system: System) -> dict[str, Channel]:
        """Path, unit, meaning and shape of its channels."""

    @abstractmethod
    def observe(self, seen: Observation) -> Iterable[Array]:
        """The values (n_t, *shape) of its channels, in their order, from the state and channels of other reports.

        Reading a channel may evaluate the model, and so overwrites what a call has left in the scratch arrays.
        """


class RowReport(Report):
    """A report whose numbers stand in the row that the compiled `observe` writes, in the order of its channels.

    The row begins with place 0, 1 and 2, which are the craft, the bodies and the markers; force terms follow.
    """

    place = 3

    def observe(self, seen: Observation) -> Iterable[Array]:
        """The columns of the row."""
        return [seen.columns(path) for path in seen.paths_of(self)]


@dataclass(frozen=True, eq=False)
class Channels:
    """The channels of a system, with those that a run does not report.

    by_report   report -> path -> Channel, of the reports that have any
    report_of   path -> its report
    columns     path -> its columns of the row that the compiled `observe` writes, (n_row,)
    """

    by_report: dict[Report, dict[str, Channel]]
    report_of: dict[str, Report]
    columns: dict[str, slice | int]
    n_row: int

    @classmethod
    def of_system(cls, system: System) -> Channels:
        """The channels of a system."""
        by_report = {report: channels for report in reports() if (channels := report.channels(system))}
        columns: dict[str, slice | int] = {}
        n = 0
        for report, channels in by_report.items():
            for path, channel in channels.items() if isinstance(report, RowReport) else ():
                size = width(channel)
                columns[path] = slice(n, n + size) if channel.shape else n
                n += size
        report_of = {path: report for report, channels in by_report.items() for path in channels}
        return cls(by_report, report_of, columns, n)

    def channel(self, path: str) -> Channel:
        """The channel of a path."""
        return self.by_report[self.report_of[path]][path]

    def reported(self) -> dict[str, Channel]:
        """Path -> Channel of those that a run reports."""
        return {path: c for channels in self.by_report.values() for path, c in channels.items() if c.reported}


class Observation(Mapping[str, Array]):
    """Channels (n_t, *shape) of a model by path, also those that a run does not report.

    A report observes when the first of its channels is read.

    times   (n_t,)
    states  (n_t, n_x), prescribed freedoms at their values
    rows    (n_t, n_row) that the compiled `observe` writes
    """

    def __init__(self, model: Model, times: Array, states: Array) -> None:
        self.model, self.system, self.times = model, model.system, np.ascontiguousarray(times, float)
        states = np.ascontiguousarray(states, float)
        self.rows = np.empty((len(self.times), model.all_channels.n_row))
        model.workspace.clear_failed()
        observe(self.times, states, self.rows, *model.workspace.arrays)
        self.states = prescribed_states(model, self.times, states)
        self.q, self.u, self.z = model.parts(self.states)
        self._values: dict[str, Array] = {}

    def columns(self, path: str) -> Array:
        """Values (n_t, *shape) of a channel in the row, before a report adds to them."""
        return np.asarray(self.rows[:, self.model.all_channels.columns[path]])

    def paths_of(self, report: Report) -> list[str]:
        """Paths of a report's channels."""
        return list(self.model.all_channels.by_report[report])

    def __getitem__(self, path: str) -> Array:
        if path not in self._values:
            report = self.model.all_channels.report_of[path]
            self._values |= zip(self.paths_of(report), report.observe(self), strict=True)
        return self._values[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self.model.all_channels.report_of)

    def __len__(self) -> int:
        return len(self.model.all_channels.report_of)


def width(channel: Channel) -> int:
    """Numbers of a channel at an instant."""
    return int(np.prod(channel.shape))


@cache
def reports() -> tuple[Report, ...]:
    """All reports, force terms included, by place."""
    force_terms = import_module("femflex.dynamics.forces.force_term").force_terms()  # which needs this file
    every = [*force_terms, *discovered(Report, "femflex.dynamics.observe")]
    return tuple(sorted(every, key=lambda report: report.place))


def discovered(kind: Any, package: str) -> tuple[Any, ...]:
    """One of each class of a kind that is defined in the files of a package, by the names of these."""
    files = pkgutil.iter_modules(import_module(package).__path__)
    values = [value for file in files for value in vars(import_module(f"{package}.{file.name}")).values()]
    kinds = [v for v in values if isinstance(v, type) and issubclass(v, kind) and not isabstract(v)]
    return tuple(each() for each in dict.fromkeys(kinds))
