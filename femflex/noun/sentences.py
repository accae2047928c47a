"""Sentences for the errors of pydantic in a case file: key path, valid entries and the most similar one."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from femflex.noun.names import ALLOWED
from femflex.noun.problems import Problem, item_label, quoted_names, suggestion_text
from femflex.noun.values import counted_noun, value_text


def schema_problems(table: type[BaseModel], raw: Any, error: ValidationError) -> list[Problem]:
    """The problems for everything that pydantic found wrong with `raw` as that table."""
    out = []
    items = error.errors(include_url=False)
    for item in items:
        loc = item["loc"]
        if loc[-1:] == ("str",) and isinstance(item.get("input"), dict) and len(items) > 1:
            continue  # of a text or a table, where a table was given; what is wrong with it is another item
        location = _locate(table, raw, item["loc"])
        out.append((item["type"], Problem(location.path, _error_sentence(item, location))))
    guessed = {
        _sibling(p.where, p.text.split("'")[1])
        for kind, p in out
        if kind == "extra_forbidden" and "did you mean" in p.text
    }
    return [problem for kind, problem in out if not (kind == "missing" and problem.where in guessed)]


def _sibling(key_path: str, key: str) -> str:
    """The path of another key of the same table."""
    parent = key_path.rpartition(".")[0]
    return f"{parent}.{key}" if parent else key


@dataclass(frozen=True)
class _Location:
    """Location of an error: key path, tables of its key, alternatives of these, and possible tables of the value."""

    path: str
    key: str
    tables: tuple[type[BaseModel], ...]
    elsewhere: tuple[type[BaseModel], ...]
    inner: tuple[type[BaseModel], ...]


def _error_sentence(item: Any, location: _Location) -> str:
    kind, value, ctx = item["type"], item.get("input"), item.get("ctx", {})
    if kind in ("value", "conflict"):
        return str(ctx["text"])
    if kind == "extra_forbidden":
        return _unknown_key(location)
    if kind == "missing" and isinstance(item["loc"][-1], int):
        return f"this entry is missing; found {counted_noun(len(value), 'entry', 'entries')} in the list"
    if kind == "missing":
        return "this key is missing" + _key_meaning(location)
    if kind == "union_tag_not_found":
        key = ctx["discriminator"].strip("'")
        return f"key {key!r} is missing; known are {quoted_names(_tags(location, key))}"
    if kind == "union_tag_invalid":
        key = ctx["discriminator"].strip("'")
        tag = str(ctx["tag"])
        found_text = repr(tag) if len(tag) < 60 else repr(tag[:57]) + "..."
        return f"found {key} = {found_text}; {suggestion_text(tag, _tags(location, key))}"
    if kind == "literal_error":
        words = [text for text in ctx["expected"].split("'") if text.strip(", ") and text.strip() != "or"]
        return f"found {value_text(value)}; " + suggestion_text(str(value), words)
    if kind == "too_short":
        return f"found {counted_noun(ctx['actual_length'], 'entry', 'entries')}; expected at least {ctx['min_length']}"
    if kind == "too_long":
        return f"found {counted_noun(ctx['actual_length'], 'entry', 'entries')}; expected at most {ctx['max_length']}"
    if kind == "string_pattern_mismatch" and ".markers." in location.path:
        return f"found {value_text(value)}; expected {_EXPECTED[kind]}. {OF_GROUP}"
    return f"found {value_text(value)}; expected {_EXPECTED.get(kind, item['msg'][0].lower() + item['msg'][1:])}"


PROPER = ("Poisson", "Rayleigh", "CSV")  # words that keep their capital letters
OF_GROUP = "The marker of a mesh group with another name gives that as its group: edge = { group = 'Kante 1' }"
_EXPECTED = {
    "string_type": "text in quotes",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "list_type": "a list; tables of a list are headed with double brackets, such as [[joints]]",
    "tuple_type": "a list",
    "dict_type": "a table of named entries",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "float_type": "a number",
    "string_pattern_mismatch": f"a name of {ALLOWED}",
}


def _unknown_key(location: _Location) -> str:
    fields = [field.alias or name for table in location.tables for name, field in table.model_fields.items()]
    tags = [
        f"{d} = {v!r}"
        for table in location.elsewhere
        if location.key in table.model_fields
        for d, v in [_tag_of(table)]
    ]
    if tags:
        return f"this key is not known here; it belongs to {' or '.join(tags)}"
    return f"this key is not known; {suggestion_text(location.key, fields)}"


def _key_meaning(location: _Location) -> str:
    field = next(
        (table.model_fields[location.key] for table in location.tables if location.key in table.model_fields), None
    )
    text = " ".join((field.description or "").split()).partition(". ")[0].rstrip(".") if field else ""
    meaning = text if text.startswith(PROPER) else f"{text[:1].lower()}{text[1:]}"
    return f" ({meaning})" if text else ""


def _tags(location: _Location, key: str) -> list[str]:
    return [value for table in location.inner for _, value in [_tag_of(table, key)] if value]


def _tag_of(table: type[BaseModel], key: str = "") -> tuple[str, str]:
    """The discriminating key and its value of one member of a union of tables."""
    for name in (key,) if key else ("kind", "method"):
        if name in table.model_fields:
            values = typing.get_args(table.model_fields[name].annotation)
            return name, str(values[0]) if values else ""
    return "", ""


def _locate(table: type[BaseModel], raw: Any, loc: Sequence[int | str]) -> _Location:
    """Follow an error's location through the raw file and the tables' types together.

    pydantic puts tags of unions into locations; an entry that is no key or index of the raw file is such a tag.
    """
    candidates: tuple[Any, ...] = (table,)
    tables: tuple[type[BaseModel], ...] = ()
    elsewhere: tuple[type[BaseModel], ...] = ()
    path, key, value = "", "", raw
    steps = [step for step in loc if step != "[key]" and not str(step).startswith("function-")]
    for k, step in enumerate(steps):
        kinds = _tables(candidates)
        tagged = [kind for kind in kinds if _tag_of(kind)[1] == step]
        is_key = isinstance(value, dict) and step in value and k + 1 == len(steps)
        if len(kinds) > 1 and tagged and not is_key:
            elsewhere = tuple(kind for kind in kinds if kind is not tagged[0])
            candidates = tuple(tagged)
            continue
        tables, key, path = kinds, str(step), _joined(path, step, value)
        if k + 1 < len(steps):
            elsewhere = ()
        candidates, value = _entry_types(candidates, step), _entry(value, step)
    return _Location(path, key, tables, elsewhere, _tables(candidates))


def _entry(value: Any, step: int | str) -> Any:
    if isinstance(value, dict):
        return value.get(step)
    return value[step] if isinstance(value, list) and isinstance(step, int) and step < len(value) else None


def _joined(path: str, step: int | str, value: Any) -> str:
    if isinstance(step, str):
        quoted = step if step.replace("_", "").replace("-", "").isalnum() else repr(step)
        return f"{path}.{quoted}" if path else quoted
    return f"{path}[{item_label(value, step)}]"


def _tables(annotations: Iterable[Any]) -> tuple[type[BaseModel], ...]:
    return tuple(a for a in _alternatives(annotations) if isinstance(a, type) and issubclass(a, BaseModel))


def _alternatives(annotations: Iterable[Any]) -> list[Any]:
    """Alternatives of unions, and the types inside Annotated."""
    out: list[Any] = []
    for annotation in annotations:
        origin = typing.get_origin(annotation)
        if origin is typing.Annotated:
            out += _alternatives([typing.get_args(annotation)[0]])
        elif origin in (typing.Union, types.UnionType):
            out += _alternatives(typing.get_args(annotation))
        else:
            out.append(annotation)
    return out


def _entry_types(annotations: Iterable[Any], step: int | str) -> tuple[Any, ...]:
    """Types of the entry `step` of a value of these types."""
    out: list[Any] = []
    for annotation in _alternatives(annotations):
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            field: FieldInfo | None = annotation.model_fields.get(str(step))
            extra = annotation.__annotations__.get("__pydantic_extra__")
            if field is not None:
                out.append(field.annotation)
            elif extra is not None:
                out.append(annotation.extra_type())  # type: ignore[attr-defined]
            continue
        arguments = typing.get_args(annotation)
        if typing.get_origin(annotation) is dict:
            out.append(arguments[1])
        elif typing.get_origin(annotation) in (list, tuple) and arguments:
            out.append(arguments[0])
    return tuple(out)
