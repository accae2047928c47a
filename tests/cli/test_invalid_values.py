"""Every value of every shipped case, replaced by one it should not have: `check` answers in sentences, in time."""

from __future__ import annotations

import random
import signal
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from support.mutations import CASES, VALUES, beside, mutated, places, raw_case, renamed, toml

from femflex.cli.check import examine_case
from femflex.cli.errors import meaning

NAMES = sorted(path.name for path in CASES.glob("*.toml"))
LONGEST = 600  # seconds of wall time of one check, on a machine however busy; a hang, not a speed, is looked for


@contextmanager
def within(seconds: int) -> Iterator[None]:
    """Context that ends with TimeoutError after so many seconds."""

    def stop(*_: Any) -> None:
        raise TimeoutError(f"over {seconds} s")

    if not hasattr(signal, "SIGALRM"):
        yield
        return
    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def answer(path: Path) -> tuple[int, str]:
    """Exit code and sentences of `femflex check`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            with within(LONGEST):
                examine_case(path)
        except Exception as error:
            code, sentences = meaning(error)
            return code, "\n".join(sentences)
    return 0, ""


def check_all(name: str, folder: Path, jobs: list[tuple[str, dict[str, Any]]]) -> None:
    """Every changed case is sound, refused, without equilibrium or beyond the eigen-solver (3), which is said why.

    Lines are short, without control characters.
    """
    for what, raw in jobs:
        path = folder / name
        path.write_text(toml(raw), encoding="utf-8")
        code, text = answer(path)
        # as under a force of 1e30 N, and with a density of 1e30 kg/m^3
        beyond = code == 3 and ("no equilibrium was found" in text or "many orders apart" in text)
        assert code in (0, 2) or beyond, f"{name}: {what}: {text}"
        assert code == 0 or text
        assert all(line.isprintable() and len(line) < 4000 for line in text.split("\n")), f"{name}: {what}: {text!r}"


def changes(name: str) -> list[tuple[str, dict[str, Any]]]:
    """All changed copies of a case, and what was changed."""
    raw = raw_case(name)
    jobs = [(f"{at} = {str(v)[:60]!r}", mutated(raw, at, v)) for at in places(raw) for v in VALUES]
    keys = ["", ".", "a/b", "\x00", "\u00e9", "x" * 3000, "a b", "kind"]
    return jobs + [
        (f"key {at} -> {k!r}", renamed(raw, at, k)) for at in places(raw) if isinstance(at[-1], str) for k in keys
    ]


@pytest.mark.slow
def test_a_sample_of_cases_with_one_value_changed_is_answered(tmp_path: Path):
    """Of small cases, whose bodies are built in no time."""
    generator, folder = random.Random(20), beside(tmp_path)
    for name in ("chaplygin_sleigh.toml", "eccentric_pitch.toml", "orbiter_yaw30.toml"):
        check_all(name, folder, generator.sample(changes(name), 30))


def test_a_sample_of_changes_to_a_meshed_case_is_refused_when_it_is_read(tmp_path: Path):
    """Values of wrong type and names of wrong letters, at every kind of key."""
    generator, folder = random.Random(21), beside(tmp_path)
    for name in ("panel_slew.toml", "four_bar.toml", "gimbal_antenna.toml"):
        raw = raw_case(name)
        wrong = [
            (f"{at} = {v!r}", mutated(raw, at, v)) for at in places(raw) for v in (True, [[]], {"kind": []}, 1e300)
        ]
        check_all(name, folder, generator.sample(wrong, 8))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_cases_with_one_value_changed_are_answered(name: str, tmp_path: Path):
    jobs = changes(name)
    check_all(name, beside(tmp_path), random.Random(22).sample(jobs, min(len(jobs), 400)))
