"""Reports as a browser shows them, and as a program reads them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from support.small_craft import BOOM, CRAFT

import femflex
from femflex.report.run import write_run_report
from femflex.results import open_run

SHAPED = "markers.left = { position = [0.5, 0, 0] }\nshapes = [{ kind = 'box', size = [1, 1, 1] }]"
EXPECT = """
[expect.turned]
of = "value"
channel = "bodies/hub/rate"
component = "x"
at = "0 s"
value = "2 deg/s"
tolerance = "1e-9 rad/s"
"""
BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = "--headless --no-sandbox --no-first-run --disable-quic --disable-background-networking --disable-sync"
FLAGS += " --disable-component-update --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader"
FLAGS += " --enable-logging=stderr --v=0 --virtual-time-budget=5000 --window-size=900,800"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Path of the report of two seconds of a hub that turns with a boom that swings."""
    pytest.importorskip("plotly", reason="plotly is not installed")
    folder = tmp_path_factory.mktemp("report")
    (folder / "boom.inp").write_text(BOOM)
    text = CRAFT.replace("markers.left = { position = [0.5, 0, 0] }", SHAPED).replace('"10 s"', '"2 s"') + EXPECT
    (folder / "craft.toml").write_text(text)
    femflex.run(folder / "craft.toml", folder / "craft.h5")
    with open_run(folder / "craft.h5") as run:
        write_run_report(run, folder / "craft.html")
    return folder / "craft.html"


def test_report_has_the_run_in_it(page):
    """Plots have the numbers of the run, tables its expectations, modes and masses; nothing is loaded from outside."""
    text = page.read_text()
    figures = [json.loads(each) for each in re.findall(r'<script type="application/json">(.*?)</script>', text)]
    with open_run(page.with_suffix(".h5")) as run:
        angles = np.degrees(run["attitude/angles"])
        drawn = [curve["y"] for figure in figures for curve in figure["data"] if len(curve["y"]) == len(run)]
        assert any(np.allclose(each, angles[:, 0], rtol=6e-6, atol=1e-9) for each in drawn)
        modes = femflex.system_modes(femflex.build_system(femflex.read_case(page.with_suffix(".toml"))))
    assert f"{modes.frequencies[-1]:.9g}" in text
    assert "turned" in text and "holds" in text and "does not hold" not in text
    assert ">200<" in text and "SHA-256" in text
    assert '<abbr title="' in text  # the case explains its keys
    assert not re.search(r'<(script|link|img|iframe)[^<>]*\s(src|href)="(?!data:)', text)
    assert page.stat().st_size < 8e6


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")
def test_browser_shows_the_craft_in_motion(page, tmp_path):
    """The canvas is drawn, differs between two times, and the console stays empty."""
    import matplotlib.image

    shots = []
    for k, t in enumerate((0.0, 1.5)):
        picture, profile = tmp_path / f"{k}.png", tmp_path / f"profile{k}"
        command = [BROWSER, *FLAGS.split(), f"--user-data-dir={profile}", f"--screenshot={picture}"]
        done = subprocess.run([*command, f"file://{page}#t={t}"], capture_output=True, text=True, timeout=240)
        assert "CONSOLE" not in done.stderr, done.stderr
        shots.append(matplotlib.image.imread(picture)[200:600, 100:800, :3])
    assert all(np.ptp(shot, axis=(0, 1)).max() > 0.5 for shot in shots)
    assert (np.abs(shots[1] - shots[0]).max(axis=2) > 0.2).mean() > 0.003
