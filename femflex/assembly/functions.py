"""Admissible functions of a case's analytic bodies: those of their tables, and added static shapes.

A moment, a torque or a force at the tip is answered by few of them: a torque by two torsional functions to 90 %. The
static shapes of the tip are exact.

Three characteristic functions along a direction are 0.5 % off in the first frequency of a blade on a hub of its own
length at 12 sqrt(EI / m L^4), and 1 % in the second; with the two static shapes of spin added 0.01 and 0.04 %.
Polynomials hold these shapes themselves, from the fourth on.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.assembly.acting_loads import LEFT_OVER, load_directions, spins_steadily
from femflex.case.body import AnalyticTable
from femflex.case.case import Case
from femflex.case.reduction import FunctionsTable
from femflex.reduction.beams.beam_functions import gauss, points_for
from femflex.reduction.beams.uniform_beam import BeamFunctions

Push = tuple[int, bool]  # axis of a beam, and whether about it

FIELDS = ("y", "z", "axial", "torsion")
ASIDE = 1e-9  # part of a direction along an axis of the beam from which on it counts
STATIC = 2  # shapes of bending along each direction: of a root that accelerates, and that starts to turn
HELD = 4  # polynomials along a direction that hold these shapes; they have all four frequencies within 0.5 %


def functions_of(
    case: Case, name: str, table: AnalyticTable, modes: int | None, frame: Array
) -> tuple[BeamFunctions, str]:
    """The functions of a body, of `modes` a field instead of the case's if given, and the notes on them.

    frame: axes of the beam in the body, rows (3, 3)
    """
    f = table.functions
    counts = {key: getattr(f, key) for key in FIELDS}
    if modes is not None:
        counts = {key: modes if count else 0 for key, count in counts.items()}
    static, tip, notes = f.static, False, []
    if (f.family, f.ends) == ("characteristic", "clamped-free"):
        own = BeamFunctions(**counts, static=f.static)
        markers = {"tip", *(key for key, marker in table.markers.items() if marker.group == "tip")}
        added = added_shapes(f.joints or [], f.loads, own, loads_at(case, name, markers, frame))
        counts, static, tip = with_static(counts, added.more), f.static or added.root, added.tip
        notes.append(added.note(counts, added.root and _is_spun(case, table)))
    if (table.strain or "linear") != "linear" and (f.y or f.z):
        spun = _spun(case, f)
        if spun and _can_be_static(f) and not static:
            counts, static = with_static(counts, 1), True
            notes.append(_added(counts))
        elif spun and f.family == "polynomial":
            notes.append(_few(min(n for key, n in counts.items() if key in "yz" and n)))
    functions = BeamFunctions(**counts, family=f.family, ends=f.ends, static=static, tip=tip)
    return functions, "; ".join(filter(None, notes))


def _is_spun(case: Case, table: AnalyticTable) -> bool:
    """Whether static shapes of a spin are wanted."""
    return (table.strain or "linear") != "linear" and _spun(case, table.functions)


def _spun(case: Case, f: FunctionsTable) -> bool:
    if f.spin is not None:
        return f.spin
    return "static" not in f.model_fields_set and spins_steadily(case)


def _can_be_static(f: FunctionsTable) -> bool:
    return not f.static and (f.family, f.ends) == ("characteristic", "clamped-free")


def _added(counts: dict[str, int]) -> str:
    n = sum((STATIC if key in "yz" else 1) for key, count in counts.items() if count)
    return (
        f"{n} static shapes of its loads (spin) in addition to its functions (spin = false in its functions "
        "would leave them out)"
    )


def with_static(counts: Mapping[str, int], more: int) -> dict[str, int]:
    """Numbers of functions of each field with the static shapes of `more` causes in addition."""
    return {key: n and n + more * (STATIC if key in "yz" else 1) for key, n in counts.items()}


@dataclass(frozen=True)
class AddedShapes:
    """Static shapes of a beam's ends in addition to its functions: of its root, and of its tip for joints or loads.

    more: how many of these it has beyond those that its functions hold already
    """

    root: bool
    joined: bool
    loaded: bool
    more: int

    @property
    def tip(self) -> bool:
        """Whether the shapes of the tip are among them."""
        return self.joined or self.loaded

    def note(self, counts: Mapping[str, int], spun: bool = False) -> str:
        """What is said of them; spun: those of the root are those of its spin too. counts: with them."""
        if not self.more:
            return ""
        n = self.more * sum((STATIC if key in "yz" else 1) for key, count in counts.items() if count)
        ends = ["root"] * self.root + ["tip"] * self.joined
        loads = ["spin"] * spun + ["tip"] * self.loaded
        causes = [f"its loads ({', '.join(loads)})"] * bool(loads) + [f"its joints ({', '.join(ends)})"] * bool(ends)
        keys = ["loads = false"] * self.loaded + ["joints = []"] * bool(ends)
        shapes = "1 static shape" if n == 1 else f"{n} static shapes"
        left_out = f"({' and '.join(keys)} in its functions would leave them out)"
        return f"{shapes} of {' and of '.join(causes)} in addition to its functions {left_out}"


def added_shapes(ends: Sequence[str], loads: bool | None, own: BeamFunctions, pushes: Iterable[Push]) -> AddedShapes:
    """The static shapes in addition to a beam's own functions: of joints at these ends, and of pushes at its tip."""
    root, tip = "root" in ends, "tip" in ends
    slow = any(_answered(own, *push) < 1.0 - LEFT_OVER for push in pushes)
    loaded = not own.tip and not tip and (slow if loads is None else loads)
    return AddedShapes(root, tip, loaded, int(root and not own.static) + int((tip or loaded) and not own.tip))


def loads_at(case: Case, name: str, markers: Container[str], frame: Array) -> set[Push]:
    """Axes of the beam along which loads of the case push these markers, and whether they turn them about it.

    frame: axes of the beam in the body, rows (3, 3)
    """
    found = set()
    for marker, ways in load_directions(case, name):
        for way in ways if marker in markers else ():
            along = np.flatnonzero(np.abs(frame[:, "xyz".index(way[-1])]) > ASIDE)
            found |= {(int(axis), len(way) == 2) for axis in along}
    return found


def _answered(own: BeamFunctions, axis: int, turns: bool) -> float:
    """Part of the static work of a unit force or moment at the tip that the functions answer; 1 of one they all lack.

    Of a cantilever with EI = GJ = EA = L = 1: a force moves its tip by 1 / 3, a moment or a torque turns it by 1.
    """
    row = (3, 2, 1)[axis] if turns else axis
    bends = row in (1, 2)
    xi, weight = gauss(points_for(own.max_count))
    curved = own.fields(xi, 1.0, 2 if bends else 1)[:, row]
    those = curved.any(axis=0)
    if not those.any():
        return 1.0
    tip = own.fields(np.ones(1), 1.0, int(bends and turns))[0, row, those]
    K = np.einsum("p,pi,pj->ij", weight, curved[:, those], curved[:, those])
    return float(tip @ np.linalg.solve(K, tip)) * (3.0 if bends and not turns else 1.0)


def _few(n: int) -> str:
    """That few polynomials are less than a spin wants; nothing where they are enough."""
    if n >= HELD:
        return ""
    return (
        f"no static shapes of its loads (spin) are added to its {n} polynomials per direction. Give {HELD} or more: "
        f"the first two frequencies of a fast blade are then within 0.5 %, and with {HELD + 1} within 0.25 %"
    )
