"""Reference of every key of a case file, from the JSON Schema that `femflex schema` prints."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from femflex.case.schema import json_schema
from generate.examples import Use, example, law_uses, motion_uses, named_uses, sources, uses_of
from generate.markdown import cell, code, save, table

Schema = dict[str, Any]
Pool = dict[int, list[Use]]
HEAD = """# Keys of a case file

A case is a TOML file. Plain numbers are in SI. A text such as `"33 m"` or `"30 deg"` carries its own unit, which is
checked for dimension. `python docs/generate/reference.py` writes this page from the schema, which `femflex schema`
prints. A key without a default is required; a dash marks a key that may be left out.

"""
PARENTS = {
    "materials": "[materials.NAME]",
    "sections": "[sections.NAME]",
    "bodies": "[bodies.NAME]",
    "joints": "[[joints]] and [[loops]]",
    "constraints": "[[constraints]]",
    "springs": "[[springs]]",
    "loads": "[[loads]]",
    "sights": "[[sights]]",
    "signals": "[signals.NAME]",
    "sensors": "[sensors.NAME]",
    "controllers": "[controllers.NAME]",
    "wheels": "[wheels.NAME]",
    "gyros": "[gyros.NAME]",
    "thrusters": "[thrusters.NAME]",
    "tanks": "[tanks.NAME]",
    "separations": "[separations.NAME]",
    "distributed_loads": "[distributed_loads.NAME]",
    "surroundings": "[surroundings.NAME]",
    "surfaces": "[surfaces.NAME]",
    "solar_pressure": "[solar_pressure.NAME]",
    "earth_radiation": "[earth_radiation.NAME]",
    "air_drag": "[air_drag.NAME]",
    "torque_rods": "[torque_rods.NAME]",
    "dipoles": "[dipoles.NAME]",
    "eddy_currents": "[eddy_currents.NAME]",
    "expect": "[expect] and [expect.NAME]",
}
SKIPPED = {"loops"}  # written like joints


def write(target: Path) -> None:
    """Write the page case_keys.md."""
    save(target / "case_keys.md", page(json_schema()))


def page(schema: Schema) -> str:
    """Text of the whole page."""
    pool: Pool = {}  # of each table, wherever it stands: many stand in several others
    _page(schema, pool)
    return _page(schema, pool)


def _page(schema: Schema, pool: Pool) -> str:
    """The page with examples from the pool, which is filled on the way."""
    root = schema["properties"]
    plain = {key: about for key, about in root.items() if not tables_of(about, schema)}
    sections = [HEAD, "## Top of the file\n", keys_table(plain, schema.get("required", []), schema)]
    for key, about in root.items():
        if key in plain or key in SKIPPED:
            continue
        tables = tables_of(about, schema)
        intro = "" if len(tables) == 1 else f"\n{cell(about.get('description', ''))}\n"  # one table has its own
        sections.append(f"\n## {PARENTS.get(key, f'[{key}]')}\n{intro}")
        for name, inner in tables.items():
            single = len(tables) == 1
            uses = uses_of(sources(), key, inner)
            sections.append(section(name, inner, schema, uses, pool, 2 if single else 3, single))
        if key == "bodies":
            bodies = [use for inner in tables.values() for use in uses_of(sources(), key, inner)]
            sections.append(shared_tables(schema, bodies, pool))
    return "\n".join(sections)


SHARED = {"markers.NAME": "MarkerTable", "initial": "InitialTable", "damping": "Damping"}  # of several bodies


def shared_tables(schema: Schema, bodies: Sequence[Use], pool: Pool) -> str:
    """The tables that several kinds of bodies have, written once."""
    text = ""
    for name, definition in SHARED.items():
        about = schema["$defs"][definition]
        uses = uses_of(bodies, name.partition(".")[0], about)
        text += section(f"bodies.NAME.{name}", about, schema, uses, pool)
    return text


def section(
    name: str, about: Schema, schema: Schema, uses: Sequence[Use], pool: Pool, depth: int = 3, single: bool = False
) -> str:
    """One table of the case with an example, and the tables inside it."""
    head = "" if single else f"\n{'#' * depth} {name}\n\n"
    text = f"{head}{cell(about.get('description', ''))}\n\n"
    text += keys_table(about.get("properties", {}), about.get("required", []), schema)
    pool.setdefault(id(about), []).extend(uses)
    text += example(uses or pool[id(about)])
    extra = about.get("additionalProperties")
    inner_tables: dict[int, tuple[str, str, Schema]] = {}  # a table once, though several keys hold it
    for key, entry in about.get("properties", {}).items():
        if key in ("laws", "options"):
            continue
        common = [schema["$defs"][name] for kind_name, name in SHARED.items() if key == kind_name.partition(".")[0]]
        for kind_name, inner_table in tables_of(entry, schema).items():
            if not any(inner_table is table for table in common):
                inner_tables.setdefault(id(inner_table), (kind_name, key, inner_table))
    if isinstance(extra, dict):
        inner_tables |= {
            id(inner_table): (kind_name, "NAME", inner_table)
            for kind_name, inner_table in tables_of(extra, schema).items()
        }
    for kind_name, key, inner_table in inner_tables.values():
        kind = f" ({kind_name})" if is_kind(inner_table) else ""
        inner_uses = uses_of(uses, key, inner_table) if key != "NAME" else named_uses(uses, inner_table)
        text += section(f"{name}.{key}{kind}", inner_table, schema, inner_uses, pool, min(depth + 1, 5))
    text += "".join(
        joint_laws(entry) for key, entry in about.get("properties", {}).items() if key == "laws" and name == "weld"
    )
    if "allOf" in about:
        text += options(about)
    return text


def tables_of(about: Schema, schema: Schema) -> dict[str, Schema]:
    """Name -> schema of the tables that a key may hold: one, or one of several kinds; {} for a value."""
    tables: dict[str, Schema] = {}
    for entry in leaves(about):
        if "$ref" in entry:
            definition = schema["$defs"][entry["$ref"].rsplit("/", 1)[-1]]
            if "properties" in definition or "additionalProperties" in definition:
                tables[kind_label(definition, entry["$ref"])] = definition
    return tables


def kind_label(definition: Schema, ref: str) -> str:
    """The kind or method that selects a table, or its name."""
    for key in ("kind", "method"):
        const = definition.get("properties", {}).get(key, {}).get("const")
        if const:
            return str(const)
    return ref.rsplit("/", 1)[-1].removesuffix("Table").lower()


def is_kind(definition: Schema) -> bool:
    """Whether a table is one of several, selected by a key."""
    return any("const" in definition.get("properties", {}).get(key, {}) for key in ("kind", "method"))


def leaves(about: Schema) -> Iterator[Schema]:
    """The schema itself, or the schemas of its alternatives, of a list's entries and of named entries."""
    for key in ("anyOf", "oneOf"):
        for entry in about.get(key, ()):
            yield from leaves(entry)
    if isinstance(about.get("items"), dict):
        yield from leaves(about["items"])
    for entry in about.get("patternProperties", {}).values():
        yield from leaves(entry)
    if isinstance(about.get("additionalProperties"), dict):
        yield from leaves(about["additionalProperties"])
    yield about


def keys_table(keys: dict[str, Schema], required: list[str], schema: Schema) -> str:
    """Key, value, unit, default and meaning of every key."""
    rows = []
    for key, about in keys.items():
        default = "required" if key in required else default_of(about)
        rows.append([code(key), value_of(about, schema), unit_of(about), default, cell(about.get("description", ""))])
    return table(("key", "value", "unit", "default", "meaning"), rows) if rows else ""


def unit_of(about: Schema) -> str:
    """SI unit of plain numbers."""
    for entry in leaves(about):
        unit = entry.get("unit")
        if unit and unit != "1":
            return str(unit)
    return ""


def default_of(about: Schema) -> str:
    """The default as TOML writes it; a dash for none, and for tables."""
    default = about.get("default")
    if default is None or isinstance(default, dict) or default in ([], ""):
        return "–"
    return code(json.dumps(default))


def value_of(about: Schema, schema: Schema) -> str:
    """The values that the key may have, in a few words."""
    words = list(dict.fromkeys(_words(about, schema)))
    return " or ".join(words)


def _words(about: Schema, schema: Schema) -> Iterator[str]:
    if "const" in about:
        yield code(json.dumps(about["const"]))
    elif "enum" in about:
        allowed = [str(word) for word in about["enum"]]
        yield ", ".join(code(word) for word in allowed) if len(allowed) <= 8 else f"one of {len(allowed)} words"
    elif "$ref" in about:
        yield "table"
    elif "anyOf" in about or "oneOf" in about:
        entries = about.get("anyOf") or about["oneOf"]
        if "unit" in about and any(entry.get("type") == "number" for entry in entries):
            yield "number"
            return
        for entry in entries:
            yield from _words(entry, schema)
    elif about.get("type") == "array":
        yield _list(about, schema)
    elif about.get("type") == "object":
        yield "tables by name" if "patternProperties" in about else "table"
    elif about.get("type") == "integer":
        yield "whole number"
    elif about.get("type") == "boolean":
        yield "true, false"
    elif about.get("type") == "string":
        yield "text"
    elif about.get("type") == "number":
        yield "number"


def _list(about: Schema, schema: Schema) -> str:
    inner = about.get("items", {})
    n = about.get("minItems") if about.get("minItems") == about.get("maxItems") else None
    if inner.get("type") == "array" and n:
        return f"{n} x {inner.get('minItems', 'n')} numbers"
    if not inner:
        return f"list of {n}" if n else "list"
    entry = value_of(inner, schema)
    plural = {"number": "numbers", "text": "texts", "table": "tables", "whole number": "whole numbers"}.get(entry)
    if n:
        return f"{n} {plural}" if plural else f"list of {n}: {entry}"
    return f"list of {plural or entry}"


def joint_laws(about: Schema) -> str:
    """The kinds of [[joints.laws]] with their keys."""
    text = "\n### joints.laws\n\n" + cell(about["description"]) + "\n\n"
    rows = []
    for entry in about["items"]["anyOf"]:
        kind = entry["properties"]["kind"]["const"]
        for key, inner in entry["properties"].items():
            if key not in ("kind", "coordinate", "name"):
                default = "required" if key in entry["required"] else default_of(inner)
                rows.append([code(kind), code(key), unit_of(inner), default, cell(inner["description"])])
    common_keys = about["items"]["anyOf"][0]["properties"]
    rows += [["all", code(key), "", "–", cell(common_keys[key]["description"])] for key in ("coordinate", "name")]
    text += table(("kind", "key", "unit", "default", "meaning"), rows) + example(law_uses())
    return text + "\n### Motions of joint coordinates\n\n" + MOTIONS + motion_kinds()


MOTIONS = """A motion is `"free"`, `"locked"` (at its initial value), a value, or a table of one of these kinds.

"""


def motion_kinds() -> str:
    """The kinds of motion with their keys."""
    from femflex.system.motion import KEYS, MEANINGS, NEEDED

    rows = []
    for kind, keys in KEYS.items():
        for key in keys:
            default = "required" if key in NEEDED.get(kind, ()) else "–"
            rows.append([code(kind), code(key), default, cell(MEANINGS[kind][key])])
    return table(("kind", "key", "default", "meaning"), rows) + example(motion_uses())


def options(about: Schema) -> str:
    """Options of each family of members."""
    rows = []
    for branch in about["allOf"]:
        family = branch["if"]["properties"]["family"]["const"]
        for key, inner in branch["then"]["properties"]["options"]["properties"].items():
            rows.append([code(family), code(key), unit_of(inner), default_of(inner), cell(inner["description"])])
    return "\n##### options of the families\n\n" + table(("family", "option", "unit", "default", "meaning"), rows)
