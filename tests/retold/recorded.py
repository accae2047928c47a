"""What was said of each craft, and the numbers that it had, when it was last looked at: files beside it.

`python tests/retold/recorded.py [CRAFT ...]` writes them anew; what then changes is to be read before it is kept.
"""

from __future__ import annotations

import json
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
from outcomes import CRAFTS, beside, text_of, told, verbs_of
from support.compared import listed, some_rows

from femflex.arrays import Array

HEAD = "$ femflex "


def known(name: str) -> tuple[dict[str, str], dict[str, Array]]:
    """Texts by verb and some rows of the numbers of a craft, as they were recorded."""
    _, *parts = (CRAFTS / f"{name}.txt").read_text(encoding="utf-8").split(HEAD)
    texts = {verb: text for verb, _, text in (part.partition("\n") for part in parts)}
    numbers = json.loads((CRAFTS / f"{name}.json").read_text(encoding="utf-8"))
    return texts, {key: np.array(value, float) for key, value in numbers.items()}


def record(craft: str) -> None:
    """Writes what is said of a craft, and its numbers, beside it."""
    path = CRAFTS / f"{craft}.toml"
    with tempfile.TemporaryDirectory() as folder:
        texts, numbers = told(text_of(craft), verbs_of(craft), Path(folder), beside(craft))
    said = "".join(f"{HEAD}{verb}\n{text.rstrip()}\n\n" for verb, text in texts.items())
    path.with_suffix(".txt").write_text(said, encoding="utf-8")
    lines = [f"{json.dumps(key)}: {listed(value)}" for key, value in some_rows(numbers).items()]
    path.with_suffix(".json").write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    for craft in sys.argv[1:] or sorted(path.stem for path in CRAFTS.glob("*.toml")):
        record(craft)
