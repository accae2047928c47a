"""Pictures of the shipped cases for the gallery: `python docs/generate/pictures.py [NAME ...]`.

Each case runs once; its stills go to docs/pictures/NAME. A case whose pictures are newer than its file is skipped.
Movies are left out.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
PICTURES = TOP / "docs" / "pictures"


def drawn(name: str) -> list[Path]:
    """The pictures that there are of a case."""
    return sorted((PICTURES / name).glob("*.png"))


def draw(case: Path) -> None:
    """Run a case with its pictures and keep the stills; what the run printed goes to run.txt beside them."""
    folder = PICTURES / case.stem
    with tempfile.TemporaryDirectory() as temporary:
        trimmed = case.parent / f".{case.stem}.gallery.toml"
        trimmed.write_text(case.read_text(encoding="utf-8").replace("movie = true", "movie = false"), encoding="utf-8")
        try:
            words = [sys.executable, "-m", "femflex", "run", str(trimmed), "-o", str(Path(temporary) / "run.h5")]
            done = subprocess.run(
                words, capture_output=True, text=True, cwd=TOP, env=os.environ | {"PYTHONPATH": str(TOP)}
            )
        finally:
            trimmed.unlink()
        if done.returncode:
            raise RuntimeError(f"{case.name} failed: {done.stderr}")
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        for picture in sorted(Path(temporary).glob("*.png")):
            shutil.copy(picture, folder / picture.name.removeprefix("run_"))
        (folder / "run.txt").write_text(done.stdout, encoding="utf-8")


def stale(case: Path) -> bool:
    """Whether the pictures of a case are missing or older than its file."""
    told = PICTURES / case.stem / "run.txt"
    return not told.exists() or told.stat().st_mtime < case.stat().st_mtime


def main(names: list[str]) -> None:
    """Draw the named cases, or all whose pictures are stale."""
    for case in sorted((TOP / "cases").glob("*.toml")):
        if case.stem in names or (not names and stale(case)):
            print(case.stem, flush=True)
            draw(case)


if __name__ == "__main__":
    main(sys.argv[1:])
