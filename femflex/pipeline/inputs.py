"""The inputs of a run as stored in its result file, and their comparison with those of a case."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.results import Run

SHOWN = 4  # differences printed


def inputs_text(case: Case) -> str:
    """JSON text with the model values of a case, the digests of its files, and the length of its run."""
    from femflex.case.named_files import LENGTH, model_values
    from femflex.pipeline.file_digests import file_digests

    length = {key: value for key in LENGTH if (value := getattr(case.run, key)) is not None}
    return json.dumps({"values": model_values(case), "files": file_digests(case), "length": length})


def inputs_of(run: Run) -> dict[str, Any] | None:
    """The inputs stored in a result file; None for a file without them."""
    text = run.attributes.get("inputs", "")
    inputs: dict[str, Any] | None = json.loads(text) if text else None
    return inputs


def changed_inputs(begun: Mapping[str, Any], case: Case) -> str:
    """Text on the differences between stored inputs and the present ones of a case; empty where there are none."""
    now = json.loads(inputs_text(case))
    values = list(differences(begun["values"], now["values"]))
    files = [
        f"the contents of {file['file']} ({where}) have changed"
        for where, file in begun["files"].items()
        if file != now["files"].get(where) and not any(text.startswith(where) for text in values)
    ]
    changes = files + values
    more = f", and {len(changes) - SHOWN} more" if len(changes) > SHOWN else ""
    return "; ".join(changes[:SHOWN]) + more


def differences(begun: Any, now: Any, where: str = "") -> Iterator[str]:
    """Texts on the differences between two tables, by key path."""
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
        old, new = _short_text(begun), _short_text(now)
        yield f"{where} was {old}, now {new}" if old != new else f"{where} was {begun!r}, now {now!r}"


def _short_text(value: Any) -> str:
    text = f"{value:.10g}" if isinstance(value, float) else repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
