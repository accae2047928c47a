"""`femflex doctor`: whether everything that femflex needs works on this machine."""

from __future__ import annotations

import platform
import sys
import time
from importlib.metadata import PackageNotFoundError, metadata, version

import typer

from femflex.cli.options import Json
from femflex.cli.progress import Patience
from femflex.cli.tables import print_line, printed, record
from femflex.cli.verb import FAILED, verb
from femflex.extras import MissingExtra, install_command, require
from femflex.worker_processes import usable_cores

LIBRARIES = ("numpy", "scipy", "numba", "scikit-fem", "meshio", "h5py", "pydantic", "pyvista", "vtk", "av")


@verb("femflex doctor")
def doctor(
    as_json: Json = False,
) -> None:
    """Check versions, compiled equations, renderer, movies and extras; exit code 3 where one does not work."""
    from femflex import __version__

    facts = {
        "femflex": __version__,
        "python": f"{platform.python_version()} in {sys.prefix}",
        "system": f"{platform.platform()}, {usable_cores()} cores",
        "libraries": ", ".join(f"{name} {version(name)}" for name in LIBRARIES if _installed(name)),
    }
    checks = {"equations": _compiled, "renderer": _rendered, "movies": _movies}
    failed = []
    with Patience("checking") as say:
        for name, check in checks.items():
            say(f"checking {name}")
            try:
                facts[name] = check()
            except MissingExtra as error:
                facts[name] = str(error)
            except Exception as error:
                failed.append(name)
                facts[name] = f"FAILED: {' '.join(str(error).split()) or type(error).__name__}"
    facts |= {f"[{extra}]": text for extra, text in _extras().items()}
    with printed(as_json):
        for name, text in facts.items():
            print_line(name, text)
        record("failed", failed)
    if failed:
        raise typer.Exit(FAILED)


def _compiled() -> str:
    """Simulate a spinning body, and say how long it took and where compiled code is stored."""
    import numpy as np

    from femflex.body import rigid_body
    from femflex.kernels.cache import cache_folders
    from femflex.pipeline.simulate import simulate
    from femflex.system import System, free

    begin = time.perf_counter()
    run = simulate(
        System({"body": rigid_body(1.0, np.diag([1.0, 2.0, 3.0]))}, (free("body", u0=[0, 0, 0, 1, 0, 0]),)), 1.0
    )
    if not np.allclose(run["bodies/body/rate"][-1], [1.0, 0.0, 0.0], atol=1e-9):
        raise RuntimeError("a body that spins about a principal axis changes its rate; reinstall numba and numpy")
    folders = ", ".join(str(folder) for folder in cache_folders())
    return f"work, {time.perf_counter() - begin:.1f} s with loading; stored in {folders}"


def _rendered() -> str:
    """Draw a small picture."""
    from femflex.view.theme import theme_of
    from femflex.view.window import open_window, screenshot_of

    begin = time.perf_counter()
    plotter = open_window((64, 64), theme_of("light"))
    try:
        kind = type(plotter.render_window).__name__
        screenshot_of(plotter, 1)
    finally:
        plotter.close()
    return f"works off screen by {kind}, {time.perf_counter() - begin:.1f} s"


def _movies() -> str:
    """Find the encoder of movies."""
    require("view", "movies")
    import av

    av.Codec("libx264", "w")
    return f"H.264 by FFmpeg's libraries in PyAV {av.__version__}"


def _extras() -> dict[str, str]:
    """Each extra -> "installed", or how to install it."""
    needed: dict[str, list[str]] = {}
    for line in metadata("femflex").get_all("Requires-Dist") or []:
        requirement, _, marker = line.partition(";")
        if "extra ==" in marker:
            extra = marker.split("extra ==")[1].strip().strip("\"'() ")
            needed.setdefault(extra, []).append(
                requirement.split(">")[0].split("<")[0].split("=")[0].split("[")[0].strip()
            )
    out = {}
    for extra, names in needed.items():
        if extra in ("test", "docs", "peers"):
            continue
        missing = [name for name in names if not _installed(name)]
        out[extra] = f"not installed: {install_command(extra)}" if missing else f"installed ({', '.join(names)})"
    return out


def _installed(name: str) -> bool:
    try:
        version(name)
    except PackageNotFoundError:
        return False
    return True
