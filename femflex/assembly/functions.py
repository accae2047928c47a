"""Admissible functions of a case's analytic bodies: those of their tables, and added static shapes.

Characteristic functions represent a moment, a torque or a force at the tip poorly: two torsional functions give 90 %
of the static work of a torque. The static shapes of the tip are exact.

With three characteristic functions per direction, the first frequency of a blade on a hub of its own length is 0.5 %
off at 12 sqrt(EI / m L^4), and the second 1 %; with the two static shapes of spin added, 0.01 and 0.04 %. Four or
more polynomials contain these shapes.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from femflex.arrays import Array
from femflex.assembly.acting_loads import LEFT_OVER, load_directions, spins_steadily
from femflex.case.body import AnalyticTable
from femflex.case.case import Case
from femflex.reduction.beams.beam_functions import gauss, points_for
from femflex.reduction.beams.uniform_beam import BeamFunctions, FunctionsTable

TipLoad = tuple[int, bool]  # axis of a beam, and whether about it

FIELDS = ("y", "z", "axial", "torsion")
COMPONENT_LIMIT = 1e-9  # direction cosine below which a direction has no component along an axis of the beam
STATIC = 2  # static shapes of bending per direction: of a translational and a rotational acceleration of the root
ENOUGH = 4  # polynomials per direction that contain these shapes; all four frequencies are then within 0.5 %


def functions_of(case: Case, name: str, table: AnalyticTable, modes: int | None) -> tuple[BeamFunctions, str]:
    """The functions of a body and notes on them, with `modes` functions per field instead of the case's if given."""
    f = table.functions
    counts = {key: getattr(f, key) for key in FIELDS}
    if modes is not None:
        counts = {key: modes if count else 0 for key, count in counts.items()}
    static, tip, notes = f.static, False, []
    is_nonlinear = (table.strain or "linear") != "linear"
    if (f.family, f.ends) == ("characteristic", "clamped-free"):
        requested = BeamFunctions(**counts, static=f.static)
        markers = {"tip", *(key for key, marker in table.markers.items() if marker.group == "tip")}
        added = added_shapes(f.joints or [], f.loads, requested, loads_at(case, name, markers, table.frame))
        counts, static, tip = with_static(counts, added.more), f.static or added.root, added.tip
        notes.append(added.note_text(counts, added.root and is_nonlinear and _wants_spin_shapes(case, f)))
    if is_nonlinear and (f.y or f.z):
        is_spun = _wants_spin_shapes(case, f)
        if is_spun and not f.static and (f.family, f.ends) == ("characteristic", "clamped-free") and not static:
            counts, static = with_static(counts, 1), True
            notes.append(_added_text(counts))
        elif is_spun and f.family == "polynomial":
            notes.append(_few_polynomials_text(min(n for key, n in counts.items() if key in "yz" and n)))
    functions = BeamFunctions(**counts, family=f.family, ends=f.ends, static=static, tip=tip)
    return functions, "; ".join(filter(None, notes))


def _wants_spin_shapes(case: Case, f: FunctionsTable) -> bool:
    if f.spin is not None:
        return f.spin
    return "static" not in f.model_fields_set and spins_steadily(case)


def _added_text(counts: dict[str, int]) -> str:
    n = sum((STATIC if key in "yz" else 1) for key, count in counts.items() if count)
    return (
        f"{n} static shapes of its loads (spin) in addition to its functions (spin = false in its functions "
        "would leave them out)"
    )


def with_static(counts: Mapping[str, int], more: int) -> dict[str, int]:
    """Numbers of functions of each field, with those of `more` additional sets of static shapes."""
    return {key: n and n + more * (STATIC if key in "yz" else 1) for key, n in counts.items()}


@dataclass(frozen=True)
class AddedShapes:
    """Static shapes that are added to a beam's functions: of its root, and of its tip for joints or loads.

    root    for a joint at the root
    joined  for a joint at the tip
    loaded  for loads at the tip
    more    number of these sets that the functions do not contain already
    """

    root: bool
    joined: bool
    loaded: bool
    more: int

    @property
    def tip(self) -> bool:
        """Whether the shapes of the tip are among them."""
        return self.joined or self.loaded

    def note_text(self, counts: Mapping[str, int], is_spun: bool = False) -> str:
        """A note on the added shapes.

        counts: numbers of functions of each field, with these; is_spun: those of the root also serve its spin
        """
        if not self.more:
            return ""
        n = self.more * sum((STATIC if key in "yz" else 1) for key, count in counts.items() if count)
        ends = ["root"] * self.root + ["tip"] * self.joined
        loads = ["spin"] * is_spun + ["tip"] * self.loaded
        origins = [f"its loads ({', '.join(loads)})"] * bool(loads) + [f"its joints ({', '.join(ends)})"] * bool(ends)
        keys = ["loads = false"] * self.loaded + ["joints = []"] * bool(ends)
        shapes = "1 static shape" if n == 1 else f"{n} static shapes"
        left_out = f"({' and '.join(keys)} in its functions would leave them out)"
        return f"{shapes} of {' and of '.join(origins)} in addition to its functions {left_out}"


def added_shapes(
    ends: Sequence[str], loads: bool | None, functions: BeamFunctions, tip_loads: Iterable[TipLoad]
) -> AddedShapes:
    """The static shapes to add to a beam's functions, for joints at these ends and for loads at its tip."""
    root, tip = "root" in ends, "tip" in ends
    slow = any(_share_of_static_work(functions, *load) < 1.0 - LEFT_OVER for load in tip_loads)
    loaded = not functions.tip and not tip and (slow if loads is None else loads)
    return AddedShapes(
        root, tip, loaded, int(root and not functions.static) + int((tip or loaded) and not functions.tip)
    )


def loads_at(case: Case, name: str, markers: Container[str], frame: Array) -> set[TipLoad]:
    """The loads of the case at these markers: axis of the beam, and whether it is a moment about this axis.

    frame: axes of the beam in the body, rows (3, 3)
    """
    tip_loads = set()
    for marker, directions in load_directions(case, name):
        for direction in directions if marker in markers else ():
            along = np.flatnonzero(np.abs(frame[:, "xyz".index(direction[-1])]) > COMPONENT_LIMIT)
            tip_loads |= {(int(axis), len(direction) == 2) for axis in along}
    return tip_loads


def _share_of_static_work(functions: BeamFunctions, axis: int, turns: bool) -> float:
    """Share of the static work of a unit force or moment at the tip that the functions represent.

    It is 1 where the beam has no functions of that field. A cantilever with EI = GJ = EA = L = 1 deflects by 1 / 3
    under a force at its tip, and turns by 1 under a moment or a torque.
    """
    row = (3, 2, 1)[axis] if turns else axis
    bends = row in (1, 2)
    xi, weight = gauss(points_for(functions.max_count))
    strains = functions.fields(xi, 1.0, 2 if bends else 1)[:, row]
    contributing = strains.any(axis=0)
    if not contributing.any():
        return 1.0
    tip = functions.fields(np.ones(1), 1.0, int(bends and turns))[0, row, contributing]
    K = np.einsum("p,pi,pj->ij", weight, strains[:, contributing], strains[:, contributing])
    return float(tip @ np.linalg.solve(K, tip)) * (3.0 if bends and not turns else 1.0)


def _few_polynomials_text(n: int) -> str:
    """A note that n polynomials per direction are too few for a spin; empty if they are enough."""
    if n >= ENOUGH:
        return ""
    return (
        f"no static shapes of its loads (spin) are added to its {n} polynomials per direction. Give {ENOUGH} or more: "
        f"the first two frequencies of a fast blade are then within 0.5 %, and with {ENOUGH + 1} within 0.25 %"
    )
