"""Write the pages of docs/reference that come from the program: case keys, verbs and channels.

Run it from the top of a clone after a change of a key, a verb or a channel:  python docs/generate/reference.py
"""

from __future__ import annotations

import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1]
PAGES = ("case_keys", "verbs", "channels")


def write(target: Path) -> None:
    """Write the three pages into a folder."""
    from generate import case_keys, channels, verbs

    for generator in (case_keys, verbs, channels):
        generator.write(target)


if __name__ == "__main__":
    sys.path[:0] = [str(DOCS), str(DOCS.parent)]
    write(DOCS / "reference")
