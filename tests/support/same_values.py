"""Whether what a case makes is what Python makes: values compared by what they say."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest


def same_values(a: Any, b: Any) -> bool:
    """Whether two values say the same: arrays by numbers, functions by where they are written and what they hold."""
    if callable(a) and hasattr(a, "__code__"):
        held = [[cell.cell_contents for cell in one.__closure__ or ()] for one in (a, b)]
        return a.__code__ is b.__code__ and same_values(*held)
    if isinstance(a, np.ndarray):
        return a.shape == np.shape(b) and np.allclose(a, b, rtol=1e-12, atol=1e-14)
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(same_values(x, y) for x, y in zip(a, b, strict=True))
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(same_values(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, float):
        return bool(a == pytest.approx(b, rel=1e-12))
    return bool(a == b)
