"""Whether a run in a file can be gone on with, and if not, what has changed."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from femflex.case import Case
    from femflex.dynamics import Model

BESIDE = {"title", "source", "description", "pictures", "expect", "study"}  # do not change what is integrated
SHOWN = 4  # differences told


def is_finished(case: Case, output: Path) -> bool:
    """Whether the run in the output file is complete, so that there is nothing to go on with.

    Raises ValueError when it was begun with a case that differs in what is integrated, saying in what.
    """
    from femflex.results import open_run

    with open_run(output) as run:
        check_same_case(run.case_text, case.text, output)
        return run.complete


def check_same_case(begun: str, now: str, output: Path) -> None:
    """Raise ValueError when two case texts ask for different runs."""
    found = list(differences(_integrated(begun), _integrated(now)))
    if found:
        more = f", and {len(found) - SHOWN} more" if len(found) > SHOWN else ""
        raise ValueError(
            f"{output} was begun with another case: {'; '.join(found[:SHOWN])}{more}. Undo the change to resume it, or "
            f"start anew without --resume"
        )


def check_same_model(model: Model, output: Path) -> None:
    """Raise ValueError when the unfinished run was begun with something else switched off, or with other meshes."""
    from femflex.pipeline.rebuilt import check_agreement
    from femflex.results import open_run

    with open_run(output) as unfinished:
        _check_omitted(unfinished.without, model.omitted, output)
        if len(unfinished):
            check_agreement(unfinished, model)


def _check_omitted(begun: Sequence[str], now: Sequence[str], output: Path) -> None:
    if set(begun) != set(now):
        first, second = (", ".join(names) or "nothing" for names in (begun, now))
        raise ValueError(
            f"{output} was begun with {first} switched off, not {second}; resume it likewise, or start anew"
        )


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
        yield f"{where} was {_short(begun)}, now {_short(now)}"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def _integrated(text: str) -> dict[str, Any]:
    return {key: value for key, value in tomllib.loads(text).items() if key not in BESIDE}
