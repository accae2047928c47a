"""Checks of a case against the System that it describes: channels, prescribed motions, and the size of the file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from femflex.advice.limits import MOST_OUTPUT_ROWS
from femflex.case.case import Case
from femflex.noun.problems import Problem, suggestion_text
from femflex.system import Channel, System


def duration_of(case: Case, system: System) -> float:
    """Duration of the run [s]."""
    return case.run.length(None if system.orbit is None else system.orbit.period)


def channel_problems(case: Case, channels: Mapping[str, Channel]) -> Iterator[Problem]:
    """Problems of channels and components that [expect], [study] and [pictures] name and the run does not have."""
    measures = [(f"expect.{name}", table) for name, table in case.expect.answers.items()]
    if case.study is not None:
        measures.append(("study.quantity", case.study.quantity))  # type: ignore[arg-type]
    for where, table in measures:
        if table.channel is None:
            continue
        if table.channel not in channels:
            yield Problem(
                f"{where}.channel",
                f"found {table.channel!r}, which the run will not report; {_near_path(table.channel, channels)}",
            )
            continue
        names, shape = channels[table.channel].names, channels[table.channel].shape
        if isinstance(table.component, str) and table.component not in names:
            yield Problem(
                f"{where}.component",
                f"found {table.component!r}, which is no entry of {table.channel}; "
                f"{suggestion_text(table.component, names)}",
            )
        if isinstance(table.component, int) and table.component >= (shape[0] if shape else 0):
            yield Problem(
                f"{where}.component",
                f"found {table.component}; {table.channel} has {shape[0] if shape else 'no'} entries, counted from 0",
            )
    keys = ("plots", "spectra", "spectrograms")
    drawn = [] if case.pictures is None else [(key, getattr(case.pictures, key)) for key in keys]
    for where, named in (
        (f"pictures.{key}[{k}]", part)
        for key, all_ in drawn
        for k, text in enumerate(all_)
        for part in text.split(" over ")
    ):
        path, _, component = named.partition(":")
        if path == "energy drift":
            continue
        if path not in channels:
            yield Problem(where, f"found {path!r}, which the run will not report; {_near_path(path, channels)}")
        elif component.isdigit() and not 1 <= int(component) <= math.prod(channels[path].shape):
            yield Problem(
                where,
                f"found entry {component} of {path}, which has {math.prod(channels[path].shape)}, counted from 1",
            )
        elif component and not component.isdigit() and component not in channels[path].names:
            yield Problem(
                where,
                f"found {component!r}, which is no entry of {path}; {suggestion_text(component, channels[path].names)}",
            )
    if case.pictures and case.pictures.colour == "light":
        if not any(channel.description.startswith("x of sun ") for channel in channels.values()):
            yield Problem("pictures.colour", "found 'light', without a sun; add [surroundings.sun] with kind = \"sun\"")
    markers = [path.split("/")[1] for path in channels if path.startswith("markers/") and path.endswith("/position")]
    markers += [path.removesuffix("/place") for path in channels if path.endswith("/place")]
    for k, marker in enumerate(case.pictures.traces if case.pictures else []):
        if marker not in markers:
            yield Problem(
                f"pictures.traces[{k}]",
                f"found {marker!r}, which is no marker of the craft; {suggestion_text(marker, markers)}",
            )


def motion_problems(case: Case, system: System) -> Iterator[Problem]:
    """Problems of prescribed motions that end before the run does."""
    end = duration_of(case, system)
    for joint in system.joints:
        for k, profile in joint.prescribed.items():
            if profile.last < end:
                yield Problem(
                    f"joints[{joint.name or joint.child}].motion",
                    f"{joint.freedom_names()[k]!r} is prescribed up to {profile.last:g} s, the run lasts {end:g} s; "
                    "give the motion to the end, or run for less",
                )


def size_problems(case: Case, system: System) -> Iterator[Problem]:
    """The problem of more than MOST_OUTPUT_ROWS rows of output, which is a mistake in the output step."""
    rows = case.run.rows(duration_of(case, system))
    if rows > MOST_OUTPUT_ROWS:
        where = "run.output_step" if case.run.output_step is not None else "run.samples"
        yield Problem(
            where, f"found {rows:.3g} rows of output, and {MOST_OUTPUT_ROWS:.0e} are the limit; raise the output step"
        )


def _near_path(path: str, channels: Mapping[str, Channel]) -> str:
    text = suggestion_text(path, channels)
    if text.startswith("did"):
        return text
    group = [name for name in channels if name.split("/")[0] == path.split("/")[0]]
    return suggestion_text(path, group or {name.rpartition("/")[0] or name for name in channels})
