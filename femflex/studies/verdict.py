"""A convergence study in words: what was reached, by what law, what to choose, and what to doubt."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from femflex.studies.convergence import Convergence


NOUNS = {"modes": "mode", "derivatives": "derivative shape", "segments": "segment"}
VARIED = {
    "modes": "number of modes",
    "mesh": "fineness of the mesh",
    "derivatives": "number of derivative shapes",
    "segments": "number of segments",
}


def verdict(found: Convergence) -> str:
    """The sentences on a study."""
    if found.whole:
        return " ".join(text for text in (_all(found), _own(found)) if text)
    said = {"one": _one, "few": _few, "constant": _constant, "unsettled": _unsettled}.get(found.trend.state, _judged)
    return " ".join(text for text in (said(found), _rounding(found)) if text)


def level_text(found: Convergence, level: int) -> str:
    """A level as words: "8 modes", "2 refinements (241 dofs)"."""
    at = np.flatnonzero(found.levels == level)
    count = int(found.counts[at[0]]) if at.size else None
    if found.over == "mesh":
        text = "the mesh as it is" if level == 0 else f"{level} refinement{'s' * (level != 1)}"
        return text if count is None else f"{text} ({count} dofs)"
    text = f"{level} {NOUNS[found.over]}{'s' * (level != 1)}"
    apart = int(found.derivatives[at[0]]) if at.size and found.derivatives.size else 0
    if count is None or (count == level and not apart):
        return text
    led = int(found.followers[at[0]]) if at.size and found.followers.size else 0
    if led and found.over == "derivatives":
        return f"{text} per body ({count} shapes, {led} of them dependent derivative shapes)"
    of_them = f", {apart} of them derivative shapes" if apart else ""
    of_them += f", and {led} dependent derivative shapes" if led else ""
    return f"{text} per body ({count} elastic coordinates{of_them})"


def law_text(found: Convergence) -> str:
    """The law in words: "with order 3.98 in the cell size, +- 0.02", "like n^-4.1", or "" without one."""
    law, scatter = found.trend.law, found.trend.scatter
    if law is None:
        return ""
    sure = math.isfinite(scatter)
    if found.over in ("mesh", "segments"):
        text = f"with order {law.rate:.2f} in the {'cell size' if found.over == 'mesh' else 'length of a segment'}"
        return text + (f", +- {scatter:.2g} over the levels" if sure else ", seen once")
    text = (
        f"like n^-{law.rate:.2f}"
        if law.kind == "algebraic"
        else f"by a factor {math.exp(-law.rate):.3g} with each mode"
    )
    return text + (f", within a factor {math.exp(scatter):.3g}" if sure else ", by two differences alone")


def _all(found: Convergence) -> str:
    """Of levels up to all the shapes there are: how few of them do."""
    last, fewest = int(found.levels[-1]), found.recommended
    text = f"{level_text(found, last)}: no further shapes exist."
    if len(found.levels) == 1 or fewest is None:
        return text
    if fewest == last:
        return f"{text} With fewer the value differs by {_relative(found, float(found.errors[-2]))} or more, relative."
    off = _relative(found, float(found.errors[found.levels == fewest][0]))
    return f"{text} Of them {level_text(found, fewest)} suffice: the value differs by {off}, relative."


def _one(found: Convergence) -> str:
    return (
        f"There is a value at {level_text(found, int(found.levels[0]))} only; convergence needs at least three levels."
    )


def _few(found: Convergence) -> str:
    change = _relative(found, abs(found.values[-1] - found.values[0]))
    return (
        f"Two levels differ by {change}, relative; an order of convergence and an error estimate need at least three."
    )


def _constant(found: Convergence) -> str:
    varied = VARIED[found.over]
    most = _relative(found, float(np.abs(found.values - found.values[-1]).max()))
    if found.recommended is None:
        return (
            f"Values differ by {most}, relative: without a trend, but by more than the tolerance {found.tolerance:g}."
        )
    return (
        f"No dependence on the {varied} is seen: values at {_span(found)} differ by {most}, relative, without a trend."
    )


def _unsettled(found: Convergence) -> str:
    changes = ", ".join(f"{change:.2g}" for change in found.changes[-3:] if math.isfinite(change))
    last = np.abs(found.changes[-2:])
    if len(last) == 2 and last[1] < last[0] and len(found.levels) == 3:
        return (
            f"Three levels are too few here: the changes over {_span(found)} ({changes} {found.unit}) follow no law, "
            "so no error is estimated. Add levels."
        )
    return (
        f"Does not converge over {_span(found)}: the changes do not fall (the last are {changes} {found.unit}). "
        "No limit is estimated; look at the quantity itself, or add levels."
    )


def _judged(found: Convergence) -> str:
    parts = [_reached(found), _trend(found)]
    parts.append(_needed(found) if found.recommended is None else _own(found))
    return " ".join(part for part in parts if part)


def _reached(found: Convergence) -> str:
    level = found.recommended
    if level is None:
        last = level_text(found, int(found.levels[found.n_resolved - 1]))
        error = _relative(found, float(found.errors[found.n_resolved - 1]))
        return f"Not converged to {found.tolerance:g}: with {last}, the estimated relative error is {error}."
    error = _relative(found, float(found.errors[found.levels == level][0]))
    enough = "suffices" if level == (0 if found.over == "mesh" else 1) else "suffice"
    text = f"{level_text(found, level)} {enough}, with an estimated relative error of {error}"
    return f"Converged to {found.tolerance:g}: {text}."


def _trend(found: Convergence) -> str:
    match found.trend.state:
        case "law":
            limit = f"{found.estimate:.9g} {found.unit}, relative uncertainty {_relative(found, found.trend.spread)}"
            return f"Errors fall {law_text(found)}; the limit is about {limit}."
        case "rounded":
            return "Only the first change is above rounding, too few for an order."
        case "swinging":
            return "Values oscillate, so there is no extrapolation and no order; errors are the last changes."
    return "The changes follow no clear law, so there is no extrapolation; errors are the last changes."


def _needed(found: Convergence) -> str:
    """Where the law would reach the tolerance."""
    law = found.trend.law
    if found.trend.rounded is not None:
        return ""
    if law is None:
        return "Try more levels."
    if found.trend.spread > 1.5 * law.size:
        return "The limit itself is not known to this accuracy; try more levels, or a larger tolerance."
    x = law.reaches(found.tolerance * found.scale)
    if found.over == "mesh":
        return f"At this rate, {math.ceil(math.log2(x) - 1e-9)} refinements would reach the tolerance."
    if found.over == "segments":
        return f"At this rate, {math.ceil(x - 1e-9)} segments would reach the tolerance."
    return f"At this rate, about {math.ceil(x)} elastic coordinates would reach the tolerance."


def _own(found: Convergence) -> str:
    """How the case itself stands."""
    if found.own is None or found.own not in found.levels or found.recommended is None:
        return ""
    error = _relative(found, float(found.errors[found.levels == found.own][0]))
    if found.over == "mesh":
        return "" if found.recommended == 0 else f"The case's own mesh has an estimated relative error of {error}."
    enough = "enough" if found.recommended <= found.own else "not enough"
    return f"The case keeps {found.own}, which is {enough} ({error})."


def _rounding(found: Convergence) -> str:
    if found.trend.rounded is None:
        return ""
    at = level_text(found, int(found.levels[found.trend.rounded]))
    if found.simulated:
        return f"From {at} on, rounding or the tolerance of the integration dominates: finer meshes show no more."
    return f"From {at} on, rounding dominates: a finer mesh loses digits. Use elements of higher order."


def _span(found: Convergence) -> str:
    first, last = int(found.levels[0]), int(found.levels[-1])
    return f"{first} to {last} {NOUNS.get(found.over, 'refinement')}s"


def _relative(found: Convergence, error: float) -> str:
    return f"{error / found.scale:.2g}"
