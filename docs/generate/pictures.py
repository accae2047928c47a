"""Pictures of the shipped cases for the gallery: `python docs/generate/pictures.py [NAME ...]`.

Each case runs once; its stills go to docs/gallery/NAME, small enough to be kept with the sources. Without names, the
cases without pictures are drawn. A movie is replaced by a still. The page is then written again. The names of COMMANDS
draw pictures of other verbs for the how-to pages.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
PICTURES = TOP / "docs" / "gallery"
HOWTO = TOP / "docs" / "howto" / "pictures"
COMMANDS = {
    "bode": (
        "linearize cases/panel_notch.toml --inputs markers/hub.origin/torque:y "
        "--outputs attitude/angles:y,effectors/share/y"
    ),
    "regions": "stability cases/gravity_gradient.toml",
    "convergence": "converge cases/panel_slew.toml --over modes",
}
WIDTH = 800  # pixels
COLOURS = {"still": 128, "plot": 48}  # of the palette


def case_pictures(name: str) -> list[Path]:
    """The pictures of a case: stills of the craft first, then modes, then plots."""
    paths = sorted((PICTURES / name).glob("*.png"))
    return sorted(paths, key=lambda path: (path.stem != "run", not path.stem.endswith("s"), "modes" not in path.stem))


def draw_case(case: Path) -> None:
    """Run a case with its pictures and keep its stills."""
    with tempfile.TemporaryDirectory() as temporary:
        cases = copy_case(case, Path(temporary))
        femflex("run", str(cases / case.name), "-o", str(cases / "run.h5"))
        shutil.rmtree(PICTURES / case.stem, ignore_errors=True)
        store_stills(cases.glob("run*.png"), PICTURES / case.stem)


def draw_command(name: str) -> None:
    """Keep the picture of a verb for a how-to page."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"{name}.png")
        femflex(*COMMANDS[name].split(), "-o", str(path))
        store_stills([path], HOWTO)


def femflex(*arguments: str) -> None:
    """Run a verb of this clone."""
    command, environment = [sys.executable, "-m", "femflex", *arguments], os.environ | {"PYTHONPATH": str(TOP)}
    process = subprocess.run(command, capture_output=True, text=True, cwd=TOP, env=environment)
    if process.returncode:
        raise RuntimeError(f"{' '.join(arguments)} failed: {process.stderr}")


def copy_case(case: Path, folder: Path) -> Path:
    """Make a folder with the case, its movie replaced by a still, and with links to the files that cases read."""
    cases = folder / "cases"
    cases.mkdir()
    (folder / "meshes").symlink_to(TOP / "meshes")
    for path in case.parent.iterdir():
        if path != case:
            (cases / path.name).symlink_to(path)
    text = case.read_text(encoding="utf-8")
    still = "" if "\npicture = true" in text or "\ntimes = [" in text else "picture = true"
    (cases / case.name).write_text(text.replace("movie = true", still), encoding="utf-8")
    return cases


def store_stills(pictures: object, folder: Path) -> None:
    """Put small copies of pictures into a folder: WIDTH pixels wide, COLOURS colours."""
    from PIL import Image

    folder.mkdir(parents=True, exist_ok=True)
    for path in sorted(pictures):  # type: ignore[call-overload]
        with Image.open(path) as image:
            picture = image.convert("RGB")
        picture = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
        name = path.name.removeprefix("run_")
        is_still = name[0].isdigit() or name.startswith(("run", "modes"))
        count = COLOURS["still" if is_still else "plot"]
        picture = picture.quantize(count, method=Image.Quantize.MEDIANCUT, kmeans=2, dither=Image.Dither.NONE)
        picture.save(folder / name, optimize=True)


def main(names: list[str]) -> None:
    """Draw the named cases, or all that have no pictures; then write the page."""
    sys.path[:0] = [str(TOP / "docs"), str(TOP)]
    from generate import gallery

    for name in sorted(COMMANDS.keys() & set(names)):
        draw_command(name)
    for case in gallery.shipped_cases():
        if case.stem in names or (not names and not case_pictures(case.stem)):
            print(case.stem, flush=True)
            draw_case(case)
    gallery.write(TOP / "docs")


if __name__ == "__main__":
    main(sys.argv[1:])
