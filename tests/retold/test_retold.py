"""Crafts with several of everything: told in other words, they are the same crafts, whatever verb reads them.

Names that begin alike, tables from last to first and other units change nothing of what is said or computed. What is
said of each as it stands is recorded beside it, word by word, and what it does, number by number.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from outcomes import CRAFTS, beside, said_at_all, text_of, told, verbs_of
from recorded import known
from support.compared import differing, same_words, some_rows
from telling import alike, in_other_units, names_of, renamed, reordered

pytestmark = pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
NAMES = sorted(path.stem for path in CRAFTS.glob("*.toml"))
DEAR = {"stations", "reels", "drawings", "charts"}  # over 5 s
EACH = [pytest.param(name, marks=[pytest.mark.slow] if name in DEAR else []) for name in NAMES]


@pytest.mark.parametrize("craft", NAMES)
def test_a_craft_does_and_is_said_to_do_what_was_recorded(craft: str, tmp_path: Path):
    texts, numbers = told(text_of(craft), verbs_of(craft), tmp_path, beside(craft))
    wanted, values = known(craft)
    assert list(texts) == list(wanted)
    assert {verb: same_words(texts[verb], wanted[verb]) for verb in texts} == dict.fromkeys(texts, "")
    assert differing(some_rows(numbers), values) == []


@pytest.mark.parametrize("craft", EACH)
def test_other_names_units_and_order_change_nothing(craft: str, tmp_path: Path):
    names = alike(names_of(text_of(craft)))
    back = {other: one for one, other in names.items()}
    verbs = {verb: renamed(verb, names) for verb in verbs_of(craft)}
    text, *others = (
        renamed(reordered(in_other_units(one)), names) for one in (text_of(craft), *beside(craft).values())
    )
    further = dict(zip(beside(craft), others, strict=True))
    texts, numbers = told(text, [*verbs.values()], tmp_path, further)
    wanted, values = known(craft)
    found = {renamed(name, back): one for name, one in some_rows(numbers).items()}
    for name in set(found) & {"q", "u", "z", "momenta"}:  # these are in the order of the tables
        found[name], values[name] = np.sort(found[name]), np.sort(values[name])
    assert differing(found, values) == []
    for verb, text in wanted.items():
        assert said_at_all(renamed(texts[verbs[verb]], back)) == said_at_all(text), verb
