"""A run as a tree of text."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femflex.results.reader import Run


def outline(run: Run) -> str:
    """What a run holds, one channel a line: shape, unit and names."""
    state = "complete" if run.complete else f"incomplete ({run.ended})" if run.ended else "incomplete"
    span = f"{len(run)} instants, {run.time[0]:g} to {run.time[-1]:g} s" if len(run) else "no instants"
    lines = [f"{run.path.name}: {run.title}" if run.title else run.path.name, f"{state}, {span}"]
    lines += [f"without {', '.join(run.without)}"] if run.without else []
    group: list[str] = []
    for path, channel in run.channels.items():
        *folders, leaf = path.split("/")
        shared = sum(group[: k + 1] == folders[: k + 1] for k in range(len(folders)))
        lines += ["  " * depth + folders[depth] for depth in range(shared, len(folders))]
        group = folders
        shape = " x ".join(str(size) for size in (len(run), *channel.shape))
        names = f"  ({', '.join(channel.names)})" if 0 < len(channel.names) <= 4 else ""
        unit = f" [{channel.unit}]" if channel.unit and len(channel.unit) <= 24 else ""
        lines.append(f"{'  ' * len(folders)}{leaf}  {shape}{unit}{names}")
    return "\n".join(lines)
