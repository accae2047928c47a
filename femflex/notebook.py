"""A run in a notebook: a view that turns, or a picture; plots; the report as a page in the notebook.

Without a path, files are written into a temporary folder, which is removed when Python ends.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import cache
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Any

from femflex.results import Run
from femflex.view.window import Drawing

TRAME = ("trame", "trame_vtk", "trame_vuetify", "ipywidgets")  # what pyvista needs for views that turn
_numbers = count(1)


def view(run: Run, time: float | None = None, **look: Any) -> Any:
    """The run at an instant: a view that turns where trame is installed and a notebook runs, else a picture.

    time  [s]; by default that of the largest elastic displacement;  look: the fields of `femflex.view.Look`
    Raises MissingExtra, ValueError and NoRenderer as `femflex.view.render_picture`.
    """
    from femflex.view.scene import render_picture, turning_view

    if _in_notebook() and all(find_spec(name) for name in TRAME):
        return turning_view(run, time, **look)
    return render_picture(run, _scratch_file(run, ".png"), time, **look)


def plot(run: Run, channels: Sequence[str], path: str | Path | None = None, **options: Any) -> Path:
    """A picture of channels over time; those of `femflex.view.plot_histories` if none is named, with its options."""
    from femflex.view.plot import plot_histories

    return plot_histories(run, path or _scratch_file(run, ".svg"), channels or None, **options)


def report(run: Run, path: str | Path | None = None, force: bool = False) -> Path:
    """The report of a run, an HTML file that a notebook shows. Raises MissingExtra, and FileExistsError."""
    from femflex.report.run import write_run_report

    target = Path(path) if path is not None else _scratch_file(run, ".html")
    write_run_report(run, target, force=force)
    return Drawing(target)


def _in_notebook() -> bool:
    """Whether a notebook's kernel runs this process."""
    try:
        from IPython.core.getipython import get_ipython
    except ImportError:
        return False
    return hasattr(get_ipython(), "kernel")


@cache
def _scratch() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="femflex_")


def _scratch_file(run: Run, suffix: str) -> Path:
    return Path(_scratch().name, f"{run.path.stem}_{next(_numbers)}{suffix}")
