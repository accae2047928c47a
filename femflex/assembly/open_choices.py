"""Automatic choices of the tables of bodies, and these tables with the choices filled in."""

from __future__ import annotations

from collections.abc import Mapping

from femflex.case.body import AnalyticTable, BodyTable, FileTable, FlexibleTable, Strain
from femflex.case.case import Case
from femflex.case.deploying import DeployingTable
from femflex.case.matrices import MatricesTable
from femflex.reduction.methods import Stretchable

AXIAL = 2  # axial functions per bending function: the stretch by bending has twice its polynomial degree


def _is_strain_open(table: BodyTable) -> bool:
    bending = isinstance(table, AnalyticTable) and (table.functions.y or table.functions.z)
    unsegmented = isinstance(table, FlexibleTable) and table.segmented_member is None
    return bool(bending or unsegmented) and getattr(table, "strain", None) is None


def _are_joints_open(table: BodyTable) -> bool:
    if isinstance(table, AnalyticTable):
        return table.functions.joints is None and "static" not in table.functions.model_fields_set
    if isinstance(table, DeployingTable):
        f = table.functions
        if f is None or table.family != "beam" or f.family not in (None, "characteristic"):
            return False
        return f.joints is None and not f.model_fields_set & {"static", "tip"}
    if not isinstance(table, FlexibleTable) or table.segmented_member is not None:
        return False
    r = table.reduction
    if not isinstance(r, Stretchable) or r.joints is not None:
        return False
    return not (r.responses or r.deflection or r.third_derivatives or isinstance(r.derivatives, int))


def open_strains(case: Case) -> list[str]:
    """Names of the bodies whose tables do not set the strain."""
    return [name for name, table in case.bodies.items() if _is_strain_open(table)]


def open_joints(case: Case) -> list[str]:
    """Names of the bodies whose tables do not set their static shapes of joints."""
    return [name for name, table in case.bodies.items() if _are_joints_open(table)]


def stiffening_remedy(table: BodyTable) -> str:
    """The remedy for a body with linear strain that axial loads stiffen, as part of a sentence."""
    if isinstance(table, FileTable):
        return f"make {table.file} anew (femflex body) from a case that gives it strain = 'condensed'"
    if isinstance(table, MatricesTable):
        return (
            "matrices hold linear strain alone (the second number is an estimate that takes the body as a line "
            "along its longest extent): give their geometric stiffness and spin, or make the body of elements, with "
            "strain = 'condensed'"
        )
    r = getattr(table, "reduction", None)
    if isinstance(r, Stretchable) and r.derivatives in ("none", 0):
        return f"drop derivatives = {r.derivatives!r} and give it strain = 'condensed'"
    return "give it strain = 'condensed'"


def linear_strain_reason(table: BodyTable) -> str:
    """The reason why a body cannot have another strain than linear; empty if it can."""
    if not isinstance(table, FlexibleTable):
        return ""
    if not isinstance(table.reduction, Stretchable):
        method = getattr(table.reduction, "method", "none")
        return f"its reduction method {method!r} has no other form; use one with derivatives, such as 'cantilever'"
    if table.reduction.derivatives in ("none", 0):
        return (
            f"with derivatives = {table.reduction.derivatives!r} its shapes cannot bend without stretching; remove "
            "that key for condensed strain"
        )
    return ""


def with_tables(case: Case, tables: Mapping[str, BodyTable]) -> Case:
    """The case in which the tables of some bodies are replaced."""
    return case.model_copy(update={"bodies": {**case.bodies, **tables}}) if tables else case


def with_strains(case: Case, strains: Mapping[str, Strain]) -> Case:
    """The case with the strain of some bodies set; with nonlinear strain, also shapes in which the body stretches."""
    tables = {}
    for name, strain in strains.items():
        table = case.bodies[name]
        stretch = _stretching_shapes(table) if strain == "nonlinear" else {}
        tables[name] = table.model_copy(update={"strain": strain, **stretch})
    return with_tables(case, tables)


def _stretching_shapes(table: BodyTable) -> dict[str, object]:
    """The keys that give a body shapes to stretch in, if its table sets none: derivatives or axial functions."""
    if isinstance(table, AnalyticTable) and not table.functions.axial:
        count = AXIAL * max(table.functions.y, table.functions.z)
        return {"functions": table.functions.model_copy(update={"axial": count})}
    if isinstance(table, FlexibleTable) and getattr(table.reduction, "derivatives", "none") is None:
        assert table.reduction is not None
        return {"reduction": table.reduction.model_copy(update={"derivatives": "auto"})}
    return {}


def with_joints(case: Case, chosen: Mapping[str, Mapping[str, list[str]]]) -> Case:
    """The case with the static shapes of joints of some bodies set: group -> directions; of beams, their ends."""
    return with_tables(case, {name: _with_joints(case.bodies[name], ways) for name, ways in chosen.items()})


def _with_joints(table: BodyTable, ways: Mapping[str, list[str]]) -> BodyTable:
    if isinstance(table, AnalyticTable | DeployingTable):
        assert table.functions is not None
        return table.model_copy(update={"functions": table.functions.model_copy(update={"joints": list(ways)})})
    assert isinstance(table, FlexibleTable) and isinstance(table.reduction, Stretchable)
    return table.model_copy(update={"reduction": table.reduction.model_copy(update={"joints": dict(ways)})})
