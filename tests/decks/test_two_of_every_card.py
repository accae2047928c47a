"""Two decks with two of every card and keyword, unlike: all that is read of them, and how they vibrate, as recorded."""

from __future__ import annotations

import re

import numpy as np
import pytest
from support import deck_texts
from support.nastran_decks import frequencies

pytestmark = pytest.mark.filterwarnings("ignore::femflex.warning.PhysicsWarning")
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")
HERTZ = {
    "two_of_every_card": [0.6118829, 1.9292897, 2.8220186, 5.7398785, 6.6003981, 11.548794, 12.848046, 16.301117],
    "two_of_every_keyword": [8.7063691, 10.269458, 13.691767, 17.206228, 17.814613, 27.57612, 28.328489, 33.947145],
}


def differences(found: str, wanted: str) -> list[tuple[str, str]]:
    """Lines that differ by more than rounding in the last digit of a number."""
    a, b = found.splitlines(), wanted.splitlines()
    a, b = a + [""] * (len(b) - len(a)), b + [""] * (len(a) - len(b))
    return [pair for pair in zip(a, b, strict=True) if pair[0] != pair[1] and not _alike(*pair)]


def _alike(one: str, other: str) -> bool:
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    x, y = (np.array(NUMBER.findall(text), float) for text in (one, other))
    return bool(np.allclose(x, y, rtol=2e-5, atol=2e-9))


@pytest.mark.parametrize("name", deck_texts.DECKS)
def test_a_deck_with_two_of_everything_is_read_and_vibrates_as_recorded(name: str):
    deck = deck_texts.read(name)
    assert differences(deck_texts.text_of(deck), deck_texts.known(name)) == []
    assert frequencies(deck, 8).tolist() == pytest.approx(HERTZ[name], rel=1e-6)
