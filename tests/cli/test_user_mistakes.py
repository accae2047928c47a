"""Mistakes of a newcomer on the command line: a sentence, exit code 2, no traceback, nothing written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from support.small_craft import BOOM, CRAFT

Called = Callable[..., tuple[int, str, str]]

TABLE = "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]"
MESH = 'mesh = "boom.inp"'
NO_CELLS = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n*NSET, NSET=ROOT\n1\n*NSET, NSET=TIP\n2\n"
PLOT = "[pictures]\nplots = ['q:{}']\n"

# what is swapped in the case (old "" appends), and the fragments reported
CASES = [
    ("[run]", "[run]]", "line 4", "not TOML"),
    ('title = "hub with a boom"', "title = hub", "line 2", "text goes in quotes"),
    (MESH, 'mesh = ""', "bodies.boom.mesh", "a folder"),
    (MESH, "mesh = 'C:\\boom.inp'", "does not exist", "relative to the case file"),
    (MESH, 'mesh = "empty.inp"', "empty.inp has no *NODE block"),
    (MESH, 'mesh = "no_cells.inp"', "no_cells.inp holds no elements that are understood"),
    (MESH, 'mesh = "junk.msh"', "does not begin with $MeshFormat"),
    ("", "[bodies.hub]\nkind = 'rigid'\n", "twice"),
    ("output_step = 0.05", "output_step = 0.05\nrtol = -1e-9", "run.rtol", "above 0"),
    ("output_step = 0.05", "output_step = 0.05\nmax_step = -1", "run.max_step", "above 0 s"),
    (TABLE, 'table = "nan.csv"', "line 3 of nan.csv has nan for fx", "finite"),
    (TABLE, 'table = "empty.csv"', "empty.csv is empty", "its first line names the columns"),
    (TABLE, 'table = "none.csv"', "'none.csv', which does not exist"),
    ('section = "tube", ', "", "beam on group 'BOOM' has no section", "tube, box"),
    ('parent = "hub"', 'parent = "boom"', "joined to itself"),
    ("", PLOT.format(99), "pictures.plots[0]", "found entry 99 of q", "counted from 1"),
    ("", "[pictures]\nmodes = ['hub']\n", "pictures.modes[0]", "rigid and has no modes"),
    ("", "[pictures]\ntimes = [99]\n", "pictures.times", "lasts from 0 to 10 s"),
    ('duration = "10 s"', 'duration = "10"', "run.duration", "without a unit"),
    ('kind = "weld"', 'kind = "Weld"', "did you mean 'weld'?"),
    ("[[loads]]", "[loads]", "loads", "double brackets"),
]


@pytest.fixture
def folder(tmp_path: Path, write_case: Callable[..., Path]) -> Path:
    """A folder with a case and files that are no good."""
    write_case()
    files = {"empty.inp": "", "no_cells.inp": NO_CELLS, "junk.msh": "hello\n", "empty.csv": "", "empty.toml": ""}
    for name, text in {**files, "nan.csv": "time [s],fx [N]\n0,1\n1,nan\n"}.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


@pytest.mark.parametrize(("old", "new", "told"), [(a, b, c) for a, b, *c in CASES], ids=[c[2] for c in CASES])
def test_a_mistaken_case_is_told_and_nothing_is_written(
    femflex: Called, craft: str, folder: Path, old: str, new: str, told: list[str]
):
    assert old in craft
    (folder / "bad.toml").write_text(craft.replace(old, new) if old else craft + new)
    before = contents(folder)
    code, out, err = femflex("run", "bad.toml", "-o", "new.h5")
    assert (code, out) == (2, "") and all(fragment in err for fragment in told), err
    assert contents(folder) == before


# words of a command, and the fragments reported; there is a finished run in run.h5, and half of it in half.h5
COMMANDS = [
    ("run empty.toml", "run: this key is missing", "bodies: this key is missing"),
    ("run .", "found a folder; name a case file"),
    ("run craft.tml", "did you mean 'craft.toml'?"),
    ("run run.h5", "not text"),
    ("run craft.toml -o run.h5", "run.h5 exists", "--force"),
    ("run craft.toml -o nowhere/x.h5", "folder nowhere does not exist"),
    ("run craft.toml -o . --force", "is a folder"),
    ("run craft.toml -o craft.toml --force", "craft.toml is an input of this case and would be lost"),
    ("run craft.toml -o boom.inp --force", "boom.inp is an input of this case"),
    ("run craft.toml -o x.h5 --without gravty", "'gravty' is not something that can be switched off"),
    ("run craft.toml -o half.h5 --resume", "half.h5 is cut short or damaged"),
    ("body craft.toml boom -o craft.toml --force", "craft.toml is an input of this case"),
    ("body craft.toml bom", "did you mean 'boom'?"),
    ("render run.h5 --at 99", "time 99 s is outside the run"),
    ("render run.h5 --view nan,0,1", "view direction", "not finite"),
    ("render run.h5 --mode 1", "--mode draws a mode of a body file", "run.h5 is a run"),
    ("render run.h5 --movie -o x.avi", "neither an .mp4 file nor a folder"),
    ("render craft.toml", "craft.toml is not a result file"),
    ("render half.h5", "half.h5 is cut short or damaged"),
    ("plot run.h5 nope", "'nope' is not in run.h5"),
    ("plot run.h5 q:0", "'0' is not a component of 'q'"),
    ("plot run.h5 q --spectrum --highest -1", "the last frequency shown is -1 Hz"),
    ("plot run.h5 -o x.txt", "written as .png or .svg"),
    ("modes craft.toml --body hub", "'hub' has no elastic modes"),
    ("modes craft.toml --mac run.h5", "run.h5 is not a femflex body file"),
    ("terms run.h5 --from 99", "0 instants"),
    ("converge craft.toml", "craft.toml has no [study]"),
    ("info half.h5", "half.h5 is cut short or damaged"),
    ("check boom.inp", "line 1: this is not TOML"),
    ("schema -o craft.toml", "craft.toml exists"),
]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A finished run of the craft, as a file's bytes."""
    import femflex

    place = tmp_path_factory.mktemp("finished")
    (place / "boom.inp").write_text(BOOM)
    (place / "craft.toml").write_text(CRAFT)
    femflex.run(place / "craft.toml", place / "run.h5").close()
    return (place / "run.h5").read_bytes()


@pytest.mark.parametrize(("words", "told"), [(words, told) for words, *told in COMMANDS], ids=[c[0] for c in COMMANDS])
def test_a_mistaken_command_is_told_and_nothing_is_written(
    femflex: Called, folder: Path, finished: bytes, words: str, told: list[str]
):
    (folder / "run.h5").write_bytes(finished)
    (folder / "half.h5").write_bytes(finished[: len(finished) // 2])
    before = contents(folder)
    code, out, err = femflex(*words.split())
    assert (code, out) == (2, "") and all(fragment in err for fragment in told), err
    assert "Traceback" not in err and contents(folder) == before


def test_a_case_that_begins_with_a_byte_order_mark_is_read(femflex: Called, craft: str, folder: Path):
    (folder / "marked.toml").write_text(craft, encoding="utf-8-sig")
    assert femflex("check", "marked.toml")[0] == 0
