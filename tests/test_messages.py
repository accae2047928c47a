"""The catalogue of messages: each row of `messages/*.toml` is a mistake or a doubtful input, refused or warned of.

A row names a base (a case of `messages/bases/`, with its mesh or deck beside it), edits it and passes it to a verb; or
it evaluates a public call. Two to four key words occur in the message; its sentences are free.
"""

from __future__ import annotations

import builtins
import re
import shutil
import tomllib
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import femflex as package
from femflex.case import read_case

MESSAGES = Path(__file__).with_name("messages")
BASES = MESSAGES / "bases"
OF_CASES = {"base", "file", "edit", "text", "verb", "code", "words"}
OF_CALLS = {"call", "error", "base", "file", "edit", "text", "words"}
MODULE = re.compile(r"(?<![\w.\"'])(?:femflex\.)?[a-z]\w*(?:\.\w+)*")


def _rows() -> list[Any]:
    out = []
    for path in sorted(MESSAGES.glob("*.toml")):
        for k, row in enumerate(_table(path).get("row", [])):
            words = row.get("words", ()) if isinstance(row, dict) else ()
            out.append(pytest.param(row, id="-".join([path.stem, str(k + 1), *map(str, words)]).replace(" ", "_")))
    return out


def _table(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{path.name}: {error}") from error


ROWS = _rows()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A fresh working folder with the bases."""
    shutil.copytree(BASES, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "1000")
    return tmp_path


@pytest.mark.parametrize("row", ROWS)
def test_message_names_fault_and_remedy(row: dict[str, Any], folder: Path, femflex: Callable[..., Any]):
    _write(row, folder)
    before = _files(folder)
    if "call" in row:
        text = _raised_message(row["call"], row.get("error", "ValueError"))
    else:
        code, out, err = femflex(*row.get("verb", f"check {row['base']}").split())
        text = out + err
        assert code == row.get("code", 2), text
    assert "Traceback" not in text
    plain = " ".join(re.sub(r"[│╭╰╮╯─]", " ", text).split()).lower()
    assert [word for word in row["words"] if word.lower() not in plain] == [], text
    if row.get("code", 2) == 2:
        assert _files(folder) == before, "a refused call leaves no file"


@pytest.mark.parametrize("row", ROWS)
def test_catalogue_is_well_formed(row: dict[str, Any]):
    allowed = OF_CALLS if "call" in row else OF_CASES
    assert set(row) <= allowed, f"unknown keys {sorted(set(row) - allowed)}; a row has {sorted(allowed)}"
    words = row["words"]
    assert 2 <= len(words) <= 4
    assert all(isinstance(word, str) and 0 < len(word) <= 40 for word in words), "key words, not sentences"
    assert not {"edit", "text"} <= set(row), "either edits or a whole text"
    assert "base" in row or "call" in row or "verb" in row
    if "base" in row and "text" not in row:
        assert (BASES / row["base"]).is_file(), row["base"]
    assert row.get("code", 2) in (0, 1, 2, 3)
    assert all(len(pair) == 2 for pair in row.get("edit", []))


@pytest.mark.parametrize("base", sorted(path.name for path in BASES.glob("*.toml")))
def test_bases_are_valid(base: str, folder: Path):
    assert read_case(folder / base).title


def _write(row: dict[str, Any], folder: Path) -> None:
    """Write the row's edited file, or its whole text."""
    name = row.get("file", row.get("base"))
    if "text" in row:
        (folder / name).write_text(row["text"])
    for old, new in row.get("edit", []):
        text = (folder / name).read_text()
        assert old in text, f"{old!r} is not in {name}"
        (folder / name).write_text(text.replace(old, new))


def _files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def _raised_message(call: str, error: str) -> str:
    """Message of the error that a public call raises, or of its warning."""
    kind = getattr(builtins, error, None) or getattr(package, error, None) or _module("femflex.warning", error)
    catch = pytest.warns if issubclass(kind, Warning) else pytest.raises
    scope = _scope(call)
    with catch(kind) as caught:
        eval(call, scope)
    if issubclass(kind, Warning):
        return " ".join(str(one.message) for one in caught)
    return " ".join(map(str, caught.value.args)) or str(caught.value)


def _scope(call: str) -> dict[str, Any]:
    """femflex's public names, and the subpackages that the call names, with their modules imported."""
    scope: dict[str, Any] = {"np": np, "femflex": package, "Path": Path}
    scope |= {name: getattr(package, name) for name in package.__all__ if name in call}
    for path in MODULE.findall(call):
        parts = path.removeprefix("femflex.").split(".")
        if parts[0] in scope or not _is_module(parts[0]):
            continue
        scope[parts[0]] = import_module(f"femflex.{parts[0]}")
    for path in MODULE.findall(call):
        parts = path.removeprefix("femflex.").split(".")
        for k in range(2, len(parts)):
            if _is_module(".".join(parts[:k])):
                import_module(f"femflex.{'.'.join(parts[:k])}")
    return scope


def _is_module(path: str) -> bool:
    place = Path(package.__file__).parent.joinpath(*path.split("."))
    return place.is_dir() or place.with_suffix(".py").is_file()


def _module(path: str, name: str) -> Any:
    return getattr(import_module(path), name)
