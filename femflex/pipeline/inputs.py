"""The inputs of a run as its result file keeps them, and what differs between two of them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.results import Run

SHOWN = 4  # differences printed


def inputs_text(case: Case) -> str:
    """The values of the model and digests of the files of a case as JSON."""
    from femflex.case.model_inputs import LENGTH, model_values
    from femflex.pipeline.file_digests import file_digests

    length = {key: value for key in LENGTH if (value := getattr(case.run, key)) is not None}
    return json.dumps({"values": model_values(case), "files": file_digests(case), "length": length})


def inputs_of(run: Run) -> dict[str, Any] | None:
    """The inputs that a result file keeps, None in a file without them."""
    text = run.attributes.get("inputs", "")
    found: dict[str, Any] | None = json.loads(text) if text else None
    return found


def changed_inputs(begun: Mapping[str, Any], case: Case) -> str:
    """What of the inputs differs from those of a case now, "" for nothing."""
    now = json.loads(inputs_text(case))
    values = list(differences(begun["values"], now["values"]))
    files = [
        f"the contents of {was['file']} ({where}) have changed"
        for where, was in begun["files"].items()
        if was != now["files"].get(where) and not any(text.startswith(where) for text in values)
    ]
    found = files + values
    more = f", and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
    return "; ".join(found[:SHOWN]) + more


def differences(begun: Any, now: Any, where: str = "") -> Iterator[str]:
    """What differs between two tables, by key path."""
    if isinstance(begun, Mapping) and isinstance(now, Mapping):
        for key in dict.fromkeys([*begun, *now]):
            path = f"{where}.{key}" if where else str(key)
            if key not in now:
                yield f"{path} is no longer there"
            elif key not in begun:
                yield f"{path} is new"
            else:
                yield from differences(begun[key], now[key], path)
    elif isinstance(begun, list) and isinstance(now, list) and len(begun) == len(now):
        for k, (a, b) in enumerate(zip(begun, now, strict=True)):
            yield from differences(a, b, f"{where}[{k}]")
    elif begun != now:
        was, new = _short(begun), _short(now)
        yield f"{where} was {was}, now {new}" if was != new else f"{where} was {begun!r}, now {now!r}"


def _short(value: Any) -> str:
    text = f"{value:.10g}" if isinstance(value, float) else repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
