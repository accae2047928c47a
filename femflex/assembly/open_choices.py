"""What the tables of bodies leave open, and these tables with choices written in."""

from __future__ import annotations

from collections.abc import Mapping

from femflex.case.body import AnalyticTable, BodyTable, FileTable, FlexibleTable, Strain
from femflex.case.case import Case
from femflex.case.deploying import DeployingTable
from femflex.case.matrices import MatricesTable
from femflex.case.reduction import CantileverTable, Stretchable
from femflex.reduction.origin import LeftOpen

AXIAL = 2  # axial functions for each of bending: the stretch of bending is of twice its degree


def open_choices(table: BodyTable) -> LeftOpen:
    """What the table of a body leaves to advice."""
    strain, joints = _leaves_strain(table), _leaves_joints(table)
    if isinstance(table, DeployingTable):
        return LeftOpen(False, joints, joints, joints, ("root",))
    if isinstance(table, AnalyticTable):
        return LeftOpen(strain, joints, joints, joints, ("root",))
    r = getattr(table, "reduction", None)
    if not isinstance(table, FlexibleTable) or not isinstance(r, Stretchable):
        return LeftOpen(strain, joints)
    held = isinstance(r, CantileverTable)
    at_roots = joints and not (held and "attachment" in r.model_fields_set)
    elsewhere = joints and not (held and "loads" in r.model_fields_set)
    return LeftOpen(strain, joints, at_roots, elsewhere, tuple(getattr(r, "clamp", ())))


def _leaves_strain(table: BodyTable) -> bool:
    bending = isinstance(table, AnalyticTable) and (table.functions.y or table.functions.z)
    whole = isinstance(table, FlexibleTable) and table.cut is None
    return bool(bending or whole) and getattr(table, "strain", None) is None


def _leaves_joints(table: BodyTable) -> bool:
    if isinstance(table, AnalyticTable):
        return table.functions.joints is None and "static" not in table.functions.model_fields_set
    if isinstance(table, DeployingTable):
        f = table.functions
        if f is None or table.family != "beam" or f.family not in (None, "characteristic"):
            return False
        return f.joints is None and not f.model_fields_set & {"static", "tip"}
    if not isinstance(table, FlexibleTable) or table.cut is not None:
        return False
    r = table.reduction
    if not isinstance(r, Stretchable) or r.joints is not None:
        return False
    return not (r.responses or r.deflection or r.third_derivatives or isinstance(r.derivatives, int))


def open_strains(case: Case) -> list[str]:
    """Names of the bodies whose strain is left to be chosen."""
    return [name for name, table in case.bodies.items() if _leaves_strain(table)]


def open_joints(case: Case) -> list[str]:
    """Names of the bodies whose tables leave it open which static shapes of joints they keep."""
    return [name for name, table in case.bodies.items() if _leaves_joints(table)]


def table_text(table: BodyTable) -> str:
    """What a table says but for its initial state and its length over time."""
    return f"{type(table).__name__} {table.model_dump_json(exclude={'initial', 'length'})}"


def remedy_of(table: BodyTable) -> str:
    """What to do for a strain that knows what pulls along a body."""
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


def bound_to_linear(table: BodyTable) -> str:
    """Why a body is to stay linear whatever bends it; nothing where it need not."""
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
    """The case with other tables of some bodies."""
    return case.model_copy(update={"bodies": {**case.bodies, **tables}}) if tables else case


def with_strains(case: Case, strains: Mapping[str, Strain]) -> Case:
    """The case with the strain of some bodies set; nonlinear with the shapes in which it stretches."""
    tables = {}
    for name, strain in strains.items():
        table = case.bodies[name]
        stretch = _stretch(table) if strain == "nonlinear" else {}
        tables[name] = table.model_copy(update={"strain": strain, **stretch})
    return with_tables(case, tables)


def _stretch(table: BodyTable) -> dict[str, object]:
    """What a body without a word of it is given to stretch in: derivatives, or axial functions."""
    if isinstance(table, AnalyticTable) and not table.functions.axial:
        most = AXIAL * max(table.functions.y, table.functions.z)
        return {"functions": table.functions.model_copy(update={"axial": most})}
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
