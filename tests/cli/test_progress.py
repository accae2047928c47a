"""Progress is shown on a terminal when something takes long, and never elsewhere."""

from __future__ import annotations

import time

import pytest

from femflex.cli import progress


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Standard error is watched, and two seconds pass at once."""
    monkeypatch.setattr(progress, "on_terminal", lambda: True)
    monkeypatch.setattr(progress, "PATIENCE", 0.0)


def test_a_bar_tells_how_far_it_is(terminal: None, capsys: pytest.CaptureFixture[str]):
    with progress.Bar("integrating", 20.0) as bar:
        bar(5.0)
        time.sleep(0.2)
    assert "integrating" in capsys.readouterr().err


def test_patience_says_what_is_being_done(terminal: None, capsys: pytest.CaptureFixture[str]):
    with progress.Patience("reading") as told:
        time.sleep(0.2)
        told("compiling")
    assert capsys.readouterr().err == "reading ...\ncompiling ...\n"


def test_nothing_is_said_to_a_file_or_before_two_seconds(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    with progress.Bar("integrating", 20.0) as bar, progress.Patience("reading") as told:
        bar(5.0)
        told("compiling")
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    with progress.Bar("integrating", 20.0) as bar, progress.Patience("reading"):
        bar(5.0)  # standard error is no terminal here
    assert capsys.readouterr().err == ""
