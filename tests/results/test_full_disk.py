"""A disk that gets full while a file is written: one sentence, exit code 3, nothing half-written left."""

from __future__ import annotations

import errno
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from femflex.body import rigid_body
from femflex.cli.errors import meaning
from femflex.reduction import load_body, save_body
from femflex.results import RunWriter, add_channels
from femflex.system import Channel
from femflex.view.output import placed

HERE = Path(__file__).parent
LIMITED = """
import resource, sys
{before}
resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, resource.RLIM_INFINITY))
from femflex.cli.errors import meaning
try:
    {call}
except Exception as error:
    print(*meaning(error), sep="|")
"""


def under_a_limit(folder: Path, before: str, call: str, size: int = 2000) -> str:
    """What is printed where files may have so many bytes."""
    script = LIMITED.format(before=before, call=call, size=size)
    done = subprocess.run([sys.executable, "-c", script], cwd=folder, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.strip()


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of file size")
def test_a_body_that_does_not_fit_leaves_nothing(tmp_path: Path):
    before = "import numpy as np\nfrom femflex.body import rigid_body\nfrom femflex.reduction import save_body\n"
    told = under_a_limit(tmp_path, before, "save_body('hub.h5', rigid_body(1.0, np.eye(3)))")
    assert told == "3|['hub.h5: file too large']"
    assert list(tmp_path.iterdir()) == []


def test_a_body_is_what_it_was_when_its_place_is_taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """An old file stays as it is when the new one cannot be written."""
    path = tmp_path / "hub.h5"
    save_body(path, rigid_body(1.0, np.eye(3)))

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("femflex.reduction.store.os.replace", full)
    with pytest.raises(OSError, match="No space left") as error:
        save_body(path, rigid_body(2.0, np.eye(3)), force=True)
    assert meaning(error.value) == (3, [f"{path}: no space left on device"])
    monkeypatch.undo()
    assert load_body(path).moments.mass == 1.0 and [found.name for found in tmp_path.iterdir()] == ["hub.h5"]


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of file size")
def test_a_text_or_picture_that_does_not_fit_leaves_nothing(tmp_path: Path):
    before = "from femflex.view.output import placed\n"
    before += "def write(name):\n    with placed(name) as part:\n        part.write_bytes(bytes(10_000))\n"
    assert under_a_limit(tmp_path, before, "write('x.csv')") == "3|['x.csv: file too large']"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of file size")
def test_a_schema_that_does_not_fit_is_told_by_the_command_line(tmp_path: Path):
    before = "from femflex.cli.app import app\n"
    script = LIMITED.format(before=before, call="app(['schema', '-o', 'case.json'])", size=2000)
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout, done.stderr) == (3, "", "femflex: case.json: file too large\n")
    assert list(tmp_path.iterdir()) == []


def test_channels_that_do_not_fit_are_refused_before_the_copy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    sys.path.insert(0, str(HERE))
    from support.known_run import CHANNELS, known_arrays, known_bodies

    path, times = tmp_path / "run.h5", np.arange(50.0)
    with RunWriter(path, CHANNELS, known_bodies()) as writer:
        writer.write_block(times, known_arrays(times))
        writer.finish(complete=True)
    before = path.read_bytes()
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=len(before)))
    with pytest.raises(OSError, match=r"cannot be written: it takes .* MB, and .* MB are free") as error:
        add_channels(path, {"terms/x": (Channel("N", "a force"), np.zeros(50))})
    assert meaning(error.value)[0] == 3
    assert path.read_bytes() == before and [found.name for found in tmp_path.iterdir()] == ["run.h5"]


def test_an_error_of_another_kind_keeps_its_own_file(tmp_path: Path):
    with pytest.raises(FileNotFoundError) as error, placed(tmp_path / "x.csv"):
        (tmp_path / "no" / "y").read_text()
    assert error.value.filename == str(tmp_path / "no" / "y")
