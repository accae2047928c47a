"""Sphinx settings: MyST pages, one theme, and pages generated from femflex itself before each build."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

from generate import api, validation  # noqa: E402

from femflex import __version__  # noqa: E402

project = "femflex"
author = "The femflex authors"
copyright = "the femflex authors"
release = version = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist", "html_image"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "generate"]
html_theme = "furo"
html_title = "femflex"
nitpicky = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
suppress_warnings = ["misc.highlighting_failure"]


def generate_pages(_app: object) -> None:
    """Write the pages that are not stored: validation and the API."""
    target = HERE / "generated"
    target.mkdir(exist_ok=True)
    for generator in (validation, api):
        generator.write(target)


def setup(app: object) -> None:
    """Connect the generators and the reader of docstrings."""
    app.connect("builder-inited", generate_pages)  # type: ignore[attr-defined]
    app.connect("autodoc-process-docstring", api.as_text)  # type: ignore[attr-defined]
