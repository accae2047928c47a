"""Build the deploying members of a case."""

from __future__ import annotations

import warnings
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from femflex.arrays import Array
from femflex.assembly.functions import FIELDS, AddedShapes, added_shapes, loads_at, with_static
from femflex.body import FlexibleBody
from femflex.case.body import BodyTable
from femflex.case.case import Case
from femflex.case.deploying import SHEETS, DeployingFunctionsTable, DeployingTable
from femflex.deployment import (
    DeployingBody,
    ElementFunctions,
    Reel,
    StringFunctions,
    StripFunctions,
    deploying_line,
    deploying_strip,
    deploying_tapered_line,
)
from femflex.deployment.body import length_range
from femflex.deployment.line import LineShapes
from femflex.deployment.shapes import MemberShapes
from femflex.noun.problems import CaseError, Problem
from femflex.reduction import BeamFunctions
from femflex.reduction.origin import Deployed, Fields, Origin
from femflex.system import LengthTable, Profile, System, Variation
from femflex.system.motion import Motion
from femflex.warning import PhysicsWarning

MORE = 8  # additional polynomials of each field, to assess the functions of a member
MORE_ACROSS = 4  # likewise across the width of a sheet that has functions in this direction


def build_deploying(case: Case, name: str, table: DeployingTable, modes: int | None = None) -> DeployingBody:
    """The member of that table, with `modes` functions of each field instead of the table's number if given.

    Raises CaseError if its length does not fit the table.
    """
    orbit = case.orbit_with_rates()
    options: dict[str, Any] = {
        "stock": table.stock,
        "until": case.run.length(None if orbit is None else orbit.period),
        "strain": table.strain,
        "damping": table.damping,
        "drum": table.drum,
        "drum_radius": table.drum_radius,
        "markers": {key: m.fraction for key, m in table.markers.items() if m.fraction is not None},
        "orientations": {key: np.array(m.orientation) for key, m in table.markers.items() if m.orientation is not None},
    }
    try:
        length = _length_or_reel(case, name, table)
        if table.family in SHEETS:
            return deploying_strip(table, _strip_functions(table, modes), length, **options)
        functions = _line_functions(case, name, table, modes)
        if table.taper is not None:
            assert isinstance(length, Profile)
            return deploying_tapered_line(table, table.taper.material(), functions, length, **options)
        return deploying_line(table, functions, length, **options)
    except (ValueError, OSError) as error:
        raise CaseError(case.path.name, [Problem(f"bodies.{name}", str(error))]) from error


def deployed_origin(case: Case, name: str, table: DeployingTable, member: DeployingBody) -> Origin:
    """The functions of a member, and polynomials that resolve it at its initial length."""
    if member.shapes.functions is None:
        return Origin()

    def resolved() -> tuple[FlexibleBody, Fields]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # the member itself has issued it
            full_table, numbers = _with_more_functions(table), member.variation.write
            if full_table.length is not None and isinstance(numbers, LengthTable):  # no other lengths are needed
                full_table = _with_constant_length(full_table, member.start[0], numbers.stock or member.start[0])
            full_member = build_deploying(case, name, full_table)
        return full_member.body, partial(_fields, full_member.shapes)

    added = getattr(member.shapes.functions, "added", np.zeros(member.shapes.functions.count, bool))
    requested = np.linalg.lstsq(member.shapes.X, np.eye(len(added))[:, ~added], rcond=None)[0]
    source = Deployed(np.asarray(requested, float), partial(_fields, member.shapes), resolved)
    return Origin(source)


def _with_more_functions(table: DeployingTable) -> DeployingTable:
    """The member with MORE polynomials for each field that has functions, MORE_ACROSS a sheet, and linear strain."""
    f = table.functions
    assert f is not None
    counts = {key: n and n + MORE for key in FIELDS if (n := getattr(f, key))}
    across = (
        f.across + MORE_ACROSS if f.across > 1 else f.across
    )  # a single one is a sheet without twist, by choice of the user
    functions = DeployingFunctionsTable(**counts, across=across, family="polynomial", straight=f.straight)
    return table.model_copy(update={"functions": functions, "strain": "linear", "damping": 0.0})


def _fields(shapes: MemberShapes, xi: Array) -> Array:
    """Displacements [m] of a line, or of points across a sheet, and twist, for each column at xi: (k, m, n)."""
    offsets = np.zeros((1, 3)) if isinstance(shapes, LineShapes) else shapes.section[0]
    moved = shapes.displacements(xi, offsets, 0)[0]
    return np.concatenate([moved.reshape(len(xi), -1, shapes.n), shapes.turns(xi)[:, :1]], axis=1)


def with_lengths_at(case: Case, t: float) -> Case | None:
    """The case whose members have constant lengths, those at a time t [s]; None if these are the initial lengths.

    It serves only to assess their functions: these members are initially straight.
    """
    tables: dict[str, BodyTable] = {}
    for name, table in case.bodies.items():
        if isinstance(table, DeployingTable) and table.length is not None and table.length.profile is not None:
            length = table.length.profile(case.path.parent)
            first, at_time = (float(length(at)[0]) for at in (0.0, t))
            if at_time != first and at_time > 0.0:
                tables[name] = _with_constant_length(table, at_time, table.stock or length_range(length, t)[1])
    return case.model_copy(update={"bodies": {**case.bodies, **tables}}) if tables else None


def _with_constant_length(table: DeployingTable, length: float, stock: float) -> DeployingTable:
    """The member of a constant length [m], out of a stock [m], without initial deflection."""
    fixed = Motion(profile=lambda _: Profile.constant(length))
    return table.model_copy(update={"length": fixed, "stock": stock, "initial": None})


def _length_or_reel(case: Case, name: str, table: DeployingTable) -> Profile | Reel:
    if table.reel is not None:
        return reel_of(name, table.reel)
    assert table.length is not None and table.length.profile is not None
    return table.length.profile(case.path.parent)


def reel_of(name: str, reel: Reel) -> Reel:
    """The reel of the body of that name."""
    return reel.model_copy(update={"name": reel.name or f"{name}_reel"})


def deploying_bodies(case: Case) -> dict[str, DeployingBody]:
    """The deploying members of a case by name."""
    return {
        name: build_deploying(case, name, table)
        for name, table in case.bodies.items()
        if isinstance(table, DeployingTable)
    }


def with_deployment(case: Case, system: System) -> System:
    """The system whose deploying members vary with their lengths, with the initial rates of their tables."""
    varying: dict[str, Variation] = {}
    ddelta = dict(system.ddelta0)
    for name, member in deploying_bodies(case).items():
        table, body = case.bodies[name], system.bodies[name]
        assert isinstance(table, DeployingTable)
        if not _same_functions(body, member):  # studies use other numbers of functions
            member = _with_functions_of(case, name, table, body)
        varying[name] = member.variation
        if table.initial is not None and table.initial.rates is None and name in system.delta0:
            ddelta[name] = member.resting_rates(system.delta0[name], table.rest)
    if not varying:
        return system
    tables = ((name, case.bodies[name]) for name in varying)
    reels = [
        reel_of(name, t.reel).effector(float(t.stock or np.inf))
        for name, t in tables
        if isinstance(t, DeployingTable) and t.reel is not None
    ]
    effectors = (*system.effectors, *reels)
    try:
        return replace(system, varying={**system.varying, **varying}, ddelta0=ddelta, effectors=effectors)
    except ValueError as error:
        problems = [Problem("", line) for line in str(error.args[0]).splitlines()]
        raise CaseError(case.path.name, problems) from error


def _added_shapes(case: Case, name: str, table: DeployingTable, modes: int | None = None) -> AddedShapes:
    """The static shapes of joints and loads that a member has in addition to its functions."""
    f = table.functions
    if f is None or table.family != "beam" or f.family not in (None, "characteristic"):
        return AddedShapes(False, False, False, 0)
    y, z, axial, torsion = (modes if count and modes is not None else count for count in _counts(f))
    beam_functions = BeamFunctions(y, z, axial, torsion, static=f.static, tip=f.tip)
    markers = {"tip", *(key for key, marker in table.markers.items() if marker.fraction == 1.0)}
    return added_shapes(f.joints or [], f.loads, beam_functions, loads_at(case, name, markers, table.frame))


def _counts(f: DeployingFunctionsTable) -> tuple[int, int, int, int]:
    return f.y, f.z, f.axial, f.torsion


def added_note(case: Case, name: str, table: DeployingTable) -> tuple[str, ...]:
    """A note on the static shapes that a member has in addition to its functions."""
    added = _added_shapes(case, name, table)
    if table.functions is None or not added.more:
        return ()
    counts = dict(zip(FIELDS, _counts(table.functions), strict=True))
    return (added.note_text(with_static(counts, added.more)),)


def _with_functions_of(case: Case, name: str, table: DeployingTable, body: FlexibleBody) -> DeployingBody:
    """The member with as many functions in each field as a body of this member was built with."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # issued when the body was built
        for n in range(1, body.n_modes + 1):
            member = build_deploying(case, name, table, n)
            if _same_functions(body, member):
                return member
    raise ValueError(f"the member has {body.n_modes} coordinates, which no number of functions gives it")


def _same_functions(body: FlexibleBody, member: DeployingBody) -> bool:
    """Whether a body has the functions of a member. Equal numbers do not suffice: the fields may differ."""
    V1, V1_member = body.strain.V1, member.body.strain.V1
    return V1.shape == V1_member.shape and np.allclose(
        V1, V1_member, rtol=1e-6, atol=1e-9 * np.abs(V1_member).max(initial=0.0)
    )


LineFunctions = BeamFunctions | StringFunctions | ElementFunctions


def _line_functions(case: Case, name: str, table: DeployingTable, modes: int | None) -> LineFunctions | None:
    f = table.functions
    if f is None:
        return None
    counts = {key: getattr(f, key) for key in FIELDS}
    counts = {key: modes if count and modes is not None else count for key, count in counts.items()}
    if f.family == "elements":
        return _element_functions(table, **counts)
    if table.family == "beam":
        added = _added_shapes(case, name, table, modes)
        y, z, axial, torsion = (with_static(counts, added.more)[key] for key in FIELDS)
        static, tip = f.static or added.root, f.tip or added.tip
        return BeamFunctions(y, z, axial, torsion, family=f.family or "characteristic", static=static, tip=tip)
    del counts["torsion"]
    return StringFunctions(**counts, tip=table.tip, family=f.family or "polynomial", straight=f.straight)


def _strip_functions(table: DeployingTable, modes: int | None) -> StripFunctions | None:
    f = table.functions
    if f is None:
        return None
    n = f.z if modes is None else modes
    if f.family == "elements":
        return StripFunctions(_element_functions(table, z=n), f.across)
    if table.family == "plate":
        return StripFunctions(BeamFunctions(z=n, family=f.family or "characteristic"), f.across)
    along = StringFunctions(z=n, tip=table.tip, family=f.family or "polynomial", straight=f.straight)
    return StripFunctions(along, f.across)


def _element_functions(table: DeployingTable, **counts: int) -> ElementFunctions:
    assert table.functions is not None
    elements = table.functions.elements or max(8, 2 * max(counts.values()))
    string = table.family in ("tether", "membrane")
    return ElementFunctions(**counts, elements=elements, string=string, held=table.tip == "held")
