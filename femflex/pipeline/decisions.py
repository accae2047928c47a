"""Systems and bodies of cases, with strain and additional shapes decided where their tables leave them open.

The bodies are built as their tables say, linear where these say nothing. Advice on the system that they make is written
into the tables, and the bodies that it changes are built again, of the same structures.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from femflex.advice.advice import Advice, doubt, notes_of, warn_of
from femflex.advice.advise import strain_doubt
from femflex.advice.bodies import KnownBodies
from femflex.advice.buckling.margin import (
    BucklingMargin,
    assessed_bodies,
    buckling_margins,
    buckling_warnings,
    unassessed_bodies,
)
from femflex.advice.curved import shape_notes
from femflex.advice.model_warnings import model_warnings
from femflex.advice.motion_estimate import estimate_motion, estimate_rigid_motion
from femflex.advice.strain import strain_advice
from femflex.advice.truncation import unassessed_truncation
from femflex.arrays import Array
from femflex.assembly.bodies import BuiltBody
from femflex.assembly.initial import requested_displacement
from femflex.assembly.open_choices import open_joints, open_strains, with_strains
from femflex.assembly.shared import shared_structures
from femflex.case.body import Strain
from femflex.case.case import Case
from femflex.pipeline.chosen_strains import bodies_with_strain
from femflex.pipeline.joint_shapes import known_system, truncation_doubts, with_joint_shapes
from femflex.pipeline.periods import check_periods
from femflex.pipeline.references import duration_of
from femflex.pipeline.start import system_of
from femflex.reduction.origin import Origin
from femflex.system import Part, System

Built = dict[str, BuiltBody]

FAR = 0.1  # displacement over length above which linear strain is doubtful


@dataclass(frozen=True, eq=False)
class Decided:
    """A case with everything that it left open written out, its system, and the advice that this follows.

    origins: what its bodies were reduced from, by name.
    """

    case: Case
    system: System
    advice: tuple[Advice, ...]
    origins: Mapping[str, Origin]

    @property
    def known(self) -> KnownBodies:
        """Its bodies, by what they were reduced from."""
        return KnownBodies(self.origins)

    @property
    def notes(self) -> dict[str, str]:
        """Notes on each body, without its warnings."""
        return notes_of(self.advice)


def build_system(case: Case, bodies: Mapping[str, Part] | None = None) -> System:
    """The System a case describes, with these bodies or with its own.

    Its own bodies that do not say their strain get the one that their places in the system call for. Warns
    (PhysicsWarning) of what is doubtful of them. Raises CaseError with everything that does not fit together.
    """
    found = decided(case, bodies)
    warn_of_build(found.advice)
    return found.system


def warn_of_build(advice: Iterable[Advice]) -> None:
    """Give the doubts as warnings that hold whatever is done with a system: how much of the mass moves does not."""
    warn_of((one for one in advice if one.decision != "mass"), stacklevel=4)


def decided(
    case: Case, bodies: Mapping[str, Part] | None = None, *, thorough: bool = False, loaded: bool = True
) -> Decided:
    """The case with all choices made, and its system: of these bodies, or of its own.

    Doubts are in its advice, not given as warnings; a run watches on its own what linear strain leaves out of bodies
    that ask for it. thorough: that is estimated here too. loaded: bodies whose strain is given are assessed by what
    buckles them, which costs a Lanczos run for each.

    Raises CaseError with everything that does not fit together.
    """
    with shared_structures():
        return _given(case, bodies) if bodies is not None else _decided(case, thorough, loaded)


def with_own_joints(case: Case) -> Case:
    """The case with the static shapes of joints written out that its bodies get in its system.

    Raises CaseError where that cannot be built.
    """
    if not open_joints(case):
        return case
    with shared_structures():
        return with_joint_shapes(case).case


def _given(case: Case, bodies: Mapping[str, Part]) -> Decided:
    system = system_of(case, bodies)
    check_periods(system, duration_of(case, system))
    advice = [*_large_displacements(case, system), *model_warnings(system, KnownBodies({}), duration_of(case, system))]
    return Decided(case, system, tuple(advice), {})


def _decided(case: Case, thorough: bool, loaded: bool) -> Decided:
    craft = with_joint_shapes(case)
    case, built, rigid = craft.case, craft.built, craft.rigid
    names = open_strains(case)
    linear = with_strains(case, dict.fromkeys(names, "linear"))
    system, known = known_system(linear, built)
    duration = duration_of(case, system)
    check_periods(system, duration)
    strains: list[Advice] = []
    why, near = "", dict[str, BucklingMargin]()
    if names or thorough:
        view = estimate_motion(system, duration, rigid)
        rigid, why = view.rigid, view.short
        near = buckling_margins(rigid, system, known)
    elif rigid is None and assessed_bodies(system, known):
        rigid, why = estimate_rigid_motion(system, duration)
    changed: Built = {}
    if names or thorough:
        ask = [name for name in system.bodies if name in names or _is_linear(system, name)]
        wanted = strain_advice(system, ask, near, view, known, _fastest(case))
        chosen = {name: one for name, one in wanted.items() if name in names}
        strains = [strain_doubt(system, known, one) for name, one in wanted.items() if name not in names]
        strains = [one for one in strains if one.doubt]
        changed, chosen_forms = bodies_with_strain(case, known, chosen)
        strains = [*chosen_forms.values(), *strains]
    if changed:
        built |= changed
        system, known = known_system(with_strains(case, _forms(system, names, strains)), built)
    if loaded and not names and not thorough:
        near = buckling_margins(rigid, system, known)
    advice = [*craft.choices, *strains]
    advice += [Advice(name, "shapes", None, text) for name, one in built.items() for text in one.notes]
    advice += shape_notes(system.bodies, known)
    advice += unassessed_bodies(system, known, rigid, why if rigid is None else rigid.short)
    advice += unassessed_truncation(system, known, craft.richer[0].richer)
    advice += buckling_warnings(system, known, near)
    advice += truncation_doubts(case, system, craft.richer)
    advice += _large_displacements(case, system)
    advice += model_warnings(system, known, duration)
    case = with_strains(case, _forms(system, names, strains))
    return Decided(case, system, tuple(advice), {name: one.origin for name, one in built.items() if one.origin})


def _large_displacements(case: Case, system: System) -> list[Advice]:
    """Doubts on bodies with linear strain that start far from their undeformed shape."""
    out = []
    for name, table in case.bodies.items():
        if table.initial is None or table.initial.marker is None or name not in system.bodies:
            continue
        if not _is_linear(system, name):
            continue
        body = system.bodies[name]
        held_at = body.marker(system.joint_of(name).child_marker).position
        wanted, length = requested_displacement(table.initial, body, held_at)
        size = float(np.linalg.norm(wanted))
        if size > FAR * length > 0.0:
            text = (
                f"initial displacement of marker {table.initial.marker!r} of body {name!r} is {size:.4g} m, "
                f"{size / length:.0%} of the length {length:.4g} m (limit {FAR:.0%}), and its strain is linear; give "
                "it strain = 'condensed', or displace it less"
            )
            out.append(doubt(name, "bend", text, size / length, FAR))
    return out


def _is_linear(system: System, name: str) -> bool:
    body = system.bodies[name]
    return bool(body.n_modes) and body.strain_form == "linear"


def _forms(system: System, names: Iterable[str], strains: Iterable[Advice]) -> dict[str, Strain]:
    """The strain of each body that leaves it open."""
    forms: dict[str, Strain] = dict.fromkeys(names, "linear")
    return forms | {one.body: one.choice for one in strains if one.body in forms}


def _fastest(case: Case) -> Array | None:
    """The fastest steady spin (3,) of a case's diagram over speeds [rad/s]; None without one."""
    given = None if case.campbell is None else case.campbell.axis or case.attitude.spin
    if case.campbell is None or given is None:
        return None
    return np.array(given) / np.linalg.norm(given) * case.campbell.speeds[-1]
