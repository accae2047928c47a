"""Admissible functions of a case's analytic bodies: those of their tables, and the added static shapes of spin.

Three characteristic functions along a direction are 0.5 % off in the first frequency of a blade on a hub of its own
length at 12 sqrt(EI / m L^4), and 1 % in the second; with the two static shapes of spin added 0.01 and 0.04 %.
Polynomials hold these shapes themselves, from the fourth on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from femflex.assembly.acting_loads import load_directions, spins_steadily
from femflex.case.body import AnalyticTable
from femflex.case.case import Case
from femflex.case.reduction import FunctionsTable
from femflex.reduction.beams.uniform_beam import BeamFunctions

STATIC = 2  # shapes of bending along each direction: of a root that accelerates, and that starts to turn
HELD = 4  # polynomials along a direction that hold these shapes; they have all four frequencies within 0.5 %


def functions_of(case: Case, name: str, table: AnalyticTable, modes: int | None) -> tuple[BeamFunctions, str]:
    """The functions of a body, of `modes` a field instead of the case's if given, and the notes on them."""
    f = table.functions
    counts = {key: getattr(f, key) for key in ("y", "z", "axial", "torsion")}
    if modes is not None:
        counts = {key: modes if count else 0 for key, count in counts.items()}
    static, tip, notes = f.static, False, []
    ends = f.joints or [] if (f.family, f.ends) == ("characteristic", "clamped-free") else []
    if ends:
        static, tip = static or "root" in ends, "tip" in ends
        more = int(tip) + int("root" in ends and not f.static)
        counts = with_static(counts, more)
        notes.append(joined(counts, ends, more, "root" in ends and _is_spun(case, table)))
    if (table.strain or "linear") != "linear" and (f.y or f.z):
        spun = _spun(case, f)
        if spun and _can_be_static(f) and not static:
            counts, static = with_static(counts, 1), True
            notes.append(_added(counts))
        elif spun and f.family == "polynomial":
            notes.append(_few(min(n for key, n in counts.items() if key in "yz" and n)))
        notes.append(_missing(case, name, f))
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


def joined(counts: Mapping[str, int], ends: Sequence[str], more: int, spun: bool) -> str:
    """Note on the static shapes of joints; spun: those of the root are those of its spin too."""
    n = more * sum((STATIC if key in "yz" else 1) for key, count in counts.items() if count)
    cause = f"{'its loads (spin) and of ' * spun}its joints ({', '.join(ends)})"
    return (
        f"{n} static shapes of {cause} in addition to its functions (joints = [] in its functions would leave them out)"
    )


def _few(n: int) -> str:
    """That few polynomials are less than a spin wants; nothing where they are enough."""
    if n >= HELD:
        return ""
    return (
        f"no static shapes of its loads (spin) are added to its {n} polynomials per direction. Give {HELD} or more: "
        f"the first two frequencies of a fast blade are then within 0.5 %, and with {HELD + 1} within 0.25 %"
    )


def _missing(case: Case, name: str, f: FunctionsTable) -> str:
    """That the functions are no static shapes of the loads; nothing where they are, as polynomials of a force are."""
    places = [f"{marker} {' '.join(ways)}" for marker, ways in load_directions(case, name) if ways]
    if not places or f.family == "polynomial":
        return ""
    return (
        f"no static shapes of its loads ({', '.join(places)}) are added to characteristic functions. "
        "Set family = 'polynomial', which represents forces and moments at the tip"
    )
