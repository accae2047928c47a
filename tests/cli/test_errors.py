"""What is a user's mistake, what failed numerics, and what a fault of femflex, however the package is reached."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import typer

import femflex as package
from femflex.cli.errors import meaning
from femflex.cli.verb import verb
from femflex.fem.formula import formula

PACKAGE = Path(package.__file__).parent


def caught(call: Callable[[], object]) -> Exception:
    """The exception that a call raises."""
    with pytest.raises(Exception) as error:
        call()
    return error.value


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: {}["hub"], "hub"),
        (lambda: b"\xff".decode(), "'utf-8' codec can't decode byte 0xff in position 0: invalid start byte"),
    ],
)
def test_the_text_of_an_error_is_what_it_says_in_full(call: Callable[[], object], text: str):
    """A key without quotes; every argument of the others."""
    assert meaning(caught(call))[1][0].partition(": ")[2].partition(": ")[2] == text


def test_what_femflex_raises_is_a_mistake_of_the_user():
    code, sentences = meaning(caught(lambda: formula("sqrt(s, s)", np.zeros(1), 1.0)))
    assert code == 2 and sentences == ["formula 'sqrt(s, s)': sqrt takes 1 argument; found 2"]


@pytest.mark.parametrize(
    ("call", "kind"),
    [
        (lambda: formula(None, np.zeros(1), 1.0), "TypeError"),  # type: ignore[arg-type]
        (lambda: package.load_body(None), "TypeError"),  # type: ignore[arg-type]
        (lambda: formula("s", "x", 1.0), "UFuncTypeError"),  # type: ignore[arg-type]
    ],
)
def test_what_python_raises_inside_femflex_is_a_fault_with_its_place(call: Callable[[], object], kind: str):
    code, sentences = meaning(caught(call))
    assert code == 1 and "fault of femflex" in sentences[0] and "femflex." in sentences[0] and ", line " in sentences[0]
    assert "FEMFLEX_TRACEBACK=1" in sentences[1]


def test_a_built_in_error_that_nobody_raised_is_a_fault_though_femflex_stood_there():
    """float("x") and {}["x"] in a function of femflex raise without a `raise` of its own."""
    space: dict[str, object] = {"__name__": "femflex.somewhere"}
    exec("def f(): return float('x')\ndef g(): return {}['x']\ndef h(): raise ValueError('a sentence')", space)
    assert meaning(caught(space["f"]))[0] == 1  # type: ignore[arg-type]
    assert meaning(caught(space["g"]))[0] == 1  # type: ignore[arg-type]
    assert meaning(caught(space["h"])) == (2, ["a sentence"])  # type: ignore[arg-type]


def test_numerics_that_fail_are_no_fault():
    assert meaning(caught(lambda: np.linalg.inv(np.zeros((2, 2))))) == (3, ["the numerics failed: Singular matrix"])


@pytest.mark.parametrize("error", [TypeError("x"), IndexError("x"), RecursionError("x"), AssertionError("x")])
def test_a_verb_turns_every_error_into_sentences(error: Exception, capsys: pytest.CaptureFixture[str]):
    @verb("none")
    def failing() -> None:
        raise error

    with pytest.raises(typer.Exit) as end:
        failing()
    err = capsys.readouterr().err
    assert end.value.exit_code == 1 and "Traceback" not in err and err.count("\n") == 2


def _call(command: list[str], cwd: Path, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, **more}
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=120)


@pytest.mark.slow
def test_a_mistake_is_a_sentence_through_links_of_every_kind(tmp_path: Path):
    """The package through a symbolic link, the interpreter through one, `-m` and the console's entry point."""
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "femflex").symlink_to(PACKAGE)
    (tmp_path / "python").symlink_to(Path(sys.executable))
    entry = "import sys; from femflex.cli import main; sys.argv[0] = 'femflex'; main()"
    for head in (["-m", "femflex"], ["-c", entry]):
        done = _call(
            [sys.executable, *head, "campbell", "x.toml", "--orders", "0"], tmp_path, PYTHONPATH=str(tmp_path / "lib")
        )
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr == "femflex: x.toml: there is no such case file; there are none\n"
    where = ":".join([str(PACKAGE.parent), *(path for path in sys.path if path)])
    done = _call([str(tmp_path / "python"), "-m", "femflex", "check", "x.toml"], tmp_path, PYTHONPATH=where)
    assert (done.returncode, done.stderr) == (2, "femflex: x.toml: there is no such case file; there are none\n")


def test_a_value_error_is_a_sentence_through_a_link(tmp_path: Path):
    """What tells a mistake from a fault is not the path of the file that raised it."""
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "femflex").symlink_to(PACKAGE)
    done = _call(
        [sys.executable, "-m", "femflex", "terms", "x.h5", "--keep", "--from", "1"],
        tmp_path,
        PYTHONPATH=str(tmp_path / "lib"),
    )
    assert done.returncode == 2
    assert done.stderr == "femflex: --keep keeps the terms of the whole run; leave out --from and --to\n"


def test_a_working_folder_that_is_gone_is_told(tmp_path: Path):
    gone = tmp_path / "gone"
    gone.mkdir()
    code = f"import os, shutil, sys\nos.chdir({str(gone)!r})\nshutil.rmtree({str(gone)!r})\n"
    code += "sys.path.insert(0, '" + str(PACKAGE.parent) + "')\nfrom femflex.cli import main\nmain()"
    done = _call([sys.executable, "-c", code, "check", "x.toml"], tmp_path)
    assert done.returncode == 2
    assert done.stderr == "femflex: the working folder does not exist any more; change to one that does\n"
