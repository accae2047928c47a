"""A disk that gets full while a file is written: one sentence, exit code 3, nothing half-written left."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.known_run import CHANNELS, known_arrays, known_bodies

from femflex.cli.errors import meaning
from femflex.results import RunWriter, add_channels
from femflex.system import Channel

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
def test_body_that_does_not_fit_leaves_no_file(tmp_path: Path):
    before = "import numpy as np\nfrom femflex.body import rigid_body\nfrom femflex.reduction import save_body\n"
    printed = under_a_limit(tmp_path, before, "save_body('hub.h5', rigid_body(1.0, np.eye(3)))")
    assert printed.startswith("3|") and "hub.h5" in printed
    assert list(tmp_path.iterdir()) == []


def test_added_channels_that_do_not_fit_leave_the_file_unchanged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):

    path, times = tmp_path / "run.h5", np.arange(50.0)
    with RunWriter(path, CHANNELS, known_bodies()) as writer:
        writer.write_block(times, known_arrays(times))
        writer.finish(complete=True)
    before = path.read_bytes()
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=len(before)))
    with pytest.raises(OSError) as error:
        add_channels(path, {"terms/x": (Channel("N", "a force"), np.zeros(50))})
    assert meaning(error.value)[0] == 3
    assert path.read_bytes() == before and [found.name for found in tmp_path.iterdir()] == ["run.h5"]
