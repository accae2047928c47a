"""Two made runs that the picture tests share."""

from __future__ import annotations

import numpy as np
import pytest
from support.made_runs import write_run

from femflex.results import open_run


@pytest.fixture(scope="session")
def tumbling(tmp_path_factory):
    """Path of a run of 20 s without an orbit."""
    return write_run(tmp_path_factory.mktemp("runs") / "tumbling.h5", np.linspace(0, 20, 401))


@pytest.fixture
def run(tumbling):
    with open_run(tumbling) as opened:
        yield opened


@pytest.fixture(scope="session")
def orbiting(tmp_path_factory):
    """A run of one orbit."""
    path = write_run(tmp_path_factory.mktemp("runs") / "librating.h5", np.linspace(0, 5400, 1201), orbital=True)
    with open_run(path) as opened:
        yield opened


@pytest.fixture
def drawn_figure(monkeypatch):
    """The figure that was written last, with the keywords it was written with; nothing is rendered."""
    from matplotlib.figure import Figure

    figures = []

    def record_figure(figure, path, **keywords):
        path.write_bytes(b"drawn")
        figures.append((figure, keywords))

    monkeypatch.setattr(Figure, "savefig", record_figure)

    def last_figure():
        figure, keywords = figures[-1]
        figure.keywords = keywords
        return figure

    return last_figure
