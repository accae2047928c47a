"""A channel of a run: one array over time, with its shape per instant, unit and meaning."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Channel:
    """Describes one data set of the result file; the first axis of the data is time.

    shape  per instant, () for a scalar;  names  of the entries along the last axis, if they have any
    frame  axes of the components: "inertial", "orbital", "body" (the channel's own), "body NAME", "marker" (the child's
           of a joint), or "" where it has no meaning
    reported  whether a run reports it; False for what is zero by construction
    """

    unit: str
    description: str
    shape: tuple[int, ...] = ()
    names: tuple[str, ...] = ()
    frame: str = ""
    reported: bool = True
