"""One self-contained HTML page: sections of text, tables, plots by plotly as plain data, and a scene by three.js."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from femflex import __version__
from femflex.arrays import Array
from femflex.extras import require
from femflex.view.curves import Curve
from femflex.view.plot import with_superscripts
from femflex.view.theme import THEMES
from femflex.view.units import time_unit
from femflex.writing import atomic_file

FIGURES = """
for (const node of document.querySelectorAll(".plot")) {
  const figure = JSON.parse(node.firstElementChild.textContent);
  node.textContent = "";
  Plotly.newPlot(node, figure.data, figure.layout, {responsive: true, displayModeBar: false});
}
"""


class Page:
    """A page under construction: sections are added, and `html` puts them together."""

    def __init__(self, title: str, lines: Sequence[str] = ()) -> None:
        self.title = title
        self._lines = lines
        self._sections: list[tuple[str, str]] = []
        self._plots = self._scene = False

    def add(self, heading: str, body: str) -> None:
        """Add a section of HTML."""
        self._sections.append((heading, body))

    def add_scene(self, heading: str, payload: str, notes: Sequence[str] = ()) -> None:
        """Add the moving scene that `femflex.report.scene.packed` gives; a page has one."""
        self._scene = True
        text = _resource("viewer.html").replace("PAYLOAD", payload)
        self.add(heading, text + paragraphs(notes))

    def add_plots(self, heading: str, figures: Iterable[dict[str, Any]], notes: Sequence[str] = ()) -> None:
        """Add figures of plotly."""
        self._plots = True
        nodes = (f'<div class="plot"><script type="application/json">{_json(each)}</script></div>' for each in figures)
        self.add(heading, "".join(nodes) + paragraphs([*notes, "Drag to zoom, double click to see all."]))

    def html(self) -> str:
        """The page. Raises MissingExtra where plots are shown and plotly is not installed."""
        parts = [
            '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<link rel="icon" href="data:,">',
            f"<title>{escape(self.title)}</title>\n<style>{_resource('page.css')}</style>",
        ]
        if self._plots:
            parts.append(f"<script>{plotly_script()}</script>")
        if self._scene:
            core, module = _resource("three/three.core.min.js"), _resource("three/three.module.min.js")
            imports = {"three": module.replace('"./three.core.min.js"', '"three-core"'), "three-core": core}
            urls = {name: f"data:text/javascript;base64,{_base64(text)}" for name, text in imports.items()}
            parts.append(f'<script type="importmap">{json.dumps({"imports": urls})}</script>')
        parts.append(f"</head>\n<body>\n<header><h1>{escape(self.title)}</h1>{paragraphs(self._lines)}</header>")
        names = [f"s{k + 1}" for k in range(len(self._sections))]
        links = (f'<a href="#{n}">{escape(head)}</a>' for n, (head, _) in zip(names, self._sections, strict=True))
        parts.append(f"<nav>{' '.join(links)}</nav>\n<main>")
        for name, (head, body) in zip(names, self._sections, strict=True):
            parts.append(f'<section id="{name}"><h2>{escape(head)}</h2>{body}</section>')
        parts.append(f"</main>\n<footer>femflex {__version__}</footer>")
        if self._plots:
            parts.append(f"<script>{FIGURES}</script>")
        if self._scene:
            parts.append(f"<!--\n{_resource('three/LICENSE')}-->")
            parts.append(f'<script type="module">{_resource("viewer.js")}</script>')
        return "\n".join([*parts, "</body>\n</html>\n"])


def write_page(page: Page, path: str | Path, force: bool) -> None:
    """Write a page. Raises MissingExtra without plotly, and OSError."""
    with atomic_file(path, force) as part:
        part.write_text(page.html(), encoding="utf-8")


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table in HTML; cells that are numbers stand to the right."""
    head = "".join(f"<th>{escape(each)}</th>" for each in heads)
    body = "".join(f"<tr>{''.join(_cell(value) for value in row)}</tr>" for row in rows)
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def paragraphs(lines: Iterable[str]) -> str:
    """Lines of plain text as paragraphs."""
    return "".join(f"<p>{escape(line)}</p>" for line in lines)


def listed(lines: Iterable[str]) -> str:
    """Lines of plain text as a list."""
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>"


def plotly_script() -> str:
    """The script of plotly. Raises MissingExtra."""
    require("report", "plots of reports")
    from plotly.offline import get_plotlyjs

    return str(get_plotlyjs())


def _cell(value: object) -> str:
    is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    text = str(value)
    if isinstance(value, float | np.floating):
        text = f"{value:.9g}" if np.isfinite(value) else ""
    return f'<td class="number">{escape(text)}</td>' if is_number else f"<td>{escape(text)}</td>"


def _json(value: object) -> str:
    """JSON that may stand in a script element."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("</", "<\\/")


def _base64(text: str) -> str:
    return base64.b64encode(text.encode()).decode()


def _resource(name: str) -> str:
    return (files("femflex.report") / name).read_text(encoding="utf-8")


MOST = 4000  # points of a curve; a longer one keeps the least and the largest of each of half as many stretches


def history(group: Sequence[Curve], duration: float) -> dict[str, Any]:
    """Curves of one ordinate over time; duration [s] chooses the unit of time."""
    seconds, unit = time_unit(duration)
    curves = [(curve.label, curve.time / seconds, curve.values) for curve in group]
    quantity = f"{group[0].quantity} [{with_superscripts(group[0].unit)}]"
    return lines(curves, f"time [{unit}]", quantity)


def lines(
    curves: Iterable[tuple[str, Array, Array]], x: str, y: str, marks: bool = False, **axes: Any
) -> dict[str, Any]:
    """A figure of curves (name, x (n,), y (n,)), and titles of its axes with units.

    marks: with their points;  axes: settings of `yaxis`
    """
    colours = THEMES["light"].lines
    data = []
    for k, (name, abscissa, ordinate) in enumerate(curves):
        abscissa, ordinate = fewer(np.asarray(abscissa, float), np.asarray(ordinate, float))
        data.append(
            {
                "type": "scatter",
                "mode": "lines+markers" if marks else "lines",
                "name": name,
                "x": plain(abscissa),
                "y": plain(ordinate),
                "line": {"width": 1.6, "color": colours[k % len(colours)]},
            }
        )
    return {"data": data, "layout": layout(x, y, len(data) > 1, **axes)}


def layout(x: str, y: str, legend: bool, **yaxis: Any) -> dict[str, Any]:
    """The layout that all figures share."""
    grid = {"gridcolor": "#e6eaef", "zerolinecolor": "#c3ccd6", "automargin": True}
    return {
        "margin": {"l": 60, "r": 12, "t": 12, "b": 44},
        "xaxis": {"title": {"text": x}, **grid},
        "yaxis": {"title": {"text": y}, "exponentformat": "power", **grid, **yaxis},
        "font": {"size": 13, "color": THEMES["light"].text},
        "plot_bgcolor": "#ffffff",
        "paper_bgcolor": "#ffffff",
        "showlegend": legend,
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
        "hovermode": "x unified",
    }


def fewer(x: Array, y: Array) -> tuple[Array, Array]:
    """At most MOST points (n,) of a curve, in its units, with the least and the largest value of every stretch."""
    if len(x) <= MOST or not np.isfinite(y).all():
        return x, y
    edges = np.linspace(0, len(x), MOST // 2 + 1).astype(np.int64)
    kept = np.array([a + k for a, b in pairwise(edges) for k in _ends(y[a:b])])
    kept = np.unique(np.concatenate([kept, [0, len(x) - 1]]))
    return x[kept], y[kept]


def _ends(part: Array) -> tuple[int, int]:
    return int(np.argmin(part)), int(np.argmax(part))


def plain(values: Array) -> list[float | None]:
    """Numbers of six digits, None where they are not finite."""
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]
