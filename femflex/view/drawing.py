"""A drawn file: a path that a notebook shows as its picture or page."""

from __future__ import annotations

import base64
from html import escape
from pathlib import Path

LARGEST = 40_000_000  # bytes of a movie or page that a notebook takes in


class Drawing(type(Path())):  # type: ignore[misc]  # Path itself cannot be subclassed before Python 3.12
    """Path of a picture, movie or page. A notebook shows PNG, SVG, MP4 and HTML files; elsewhere it is a path."""

    __slots__ = ()

    def _repr_png_(self) -> bytes | None:
        return self.read_bytes() if self.suffix.lower() == ".png" and self.is_file() else None

    def _repr_svg_(self) -> str | None:
        return self.read_text(encoding="utf-8") if self.suffix.lower() == ".svg" and self.is_file() else None

    def _repr_html_(self) -> str | None:
        if not self.is_file() or self.stat().st_size > LARGEST:
            return None
        if self.suffix.lower() in (".html", ".htm"):
            text = escape(self.read_text(encoding="utf-8"))
            return f'<iframe srcdoc="{text}" width="100%" height="700" style="border:0"></iframe>'
        if self.suffix.lower() != ".mp4":
            return None
        data = base64.b64encode(self.read_bytes()).decode("ascii")
        return f'<video controls loop width="100%" src="data:video/mp4;base64,{data}"></video>'
