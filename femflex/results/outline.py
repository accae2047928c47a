"""Text trees of a run, or of the channels that it will have."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from femflex.system.channel import Channel

if TYPE_CHECKING:
    from femflex.results.reader import Run


def outline(run: Run) -> str:
    """Contents of a run, one channel a line: shape, unit and names."""
    state = "complete" if run.complete else f"incomplete ({run.ended})" if run.ended else "incomplete"
    span = f"{len(run)} instants, {run.time[0]:g} to {run.time[-1]:g} s" if len(run) else "no instants"
    lines = [f"{run.path.name}: {run.title}" if run.title else run.path.name, f"{state}, {span}"]
    lines += [f"without {', '.join(run.without)}"] if run.without else []
    return "\n".join([*lines, *channel_lines(run.channels, len(run))])


def channel_lines(channels: Mapping[str, Channel], n_t: int | None = None) -> list[str]:
    """Channels by path as a tree, one a line: shape, unit and names; n_t: number of instants, where it is known.

    >>> channel_lines({"joints/hinge/angle": Channel("rad", "angle of turn")})
    ['joints', '  hinge', '    angle  n [rad]']
    """
    lines, group = [], list[str]()
    for path, channel in channels.items():
        if 0 in channel.shape:  # amplitudes of a rigid body
            continue
        *folders, leaf = path.split("/")
        shared = 0
        while shared < min(len(folders), len(group)) and folders[shared] == group[shared]:
            shared += 1
        lines += ["  " * depth + folders[depth] for depth in range(shared, len(folders))]
        group = folders
        shape = " x ".join(map(str, ("n" if n_t is None else n_t, *channel.shape)))
        names = f"  ({names_text(channel.names)})" if channel.names else ""
        unit = f" [{channel.unit}]" if channel.unit and len(channel.unit) <= 24 else ""
        lines.append(f"{'  ' * len(folders)}{leaf}  {shape}{unit}{names}")
    return lines


def names_text(names: Sequence[str]) -> str:
    """Names in one line; of three or more that are numbered in sequence, such as amplitudes of a body, only the ends.

    >>> names_text(["hinge.angle", "boom.delta1", "boom.delta2", "boom.delta3"])
    'hinge.angle, boom.delta1 to boom.delta3'
    """
    runs: list[list[str]] = []
    for name in names:
        if runs and name == re.sub(r"\d+(?=\D*$)", lambda match: str(int(match[0]) + 1), runs[-1][-1]) != runs[-1][-1]:
            runs[-1].append(name)
        else:
            runs.append([name])
    return ", ".join(f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(run) for run in runs)
