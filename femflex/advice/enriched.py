"""A body in more shapes than it keeps: what its set leaves out can be seen in them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from femflex.body.flexible import FlexibleBody

Array = NDArray[np.float64]
Place = tuple[str, str]  # group or end of the body, and a direction there ("" for all that belong together)


@dataclass(frozen=True, eq=False)
class Enriched:
    """A body with linear strain in a richer set; for small motions about rest alone.

    body     with the markers of the body it was made from
    kept     (n, k) the shapes that the body has, in coordinates of the richer set
    choices  by place: static shapes (n, m) that could be added to these
    """

    body: FlexibleBody
    kept: Array
    choices: Mapping[Place, Array]


Enrichment = Callable[["FlexibleBody", Collection[str]], Enriched]
"""Makes the Enriched of a body whose joints and loops are at the markers of these names."""
