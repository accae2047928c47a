"""Base of forces on surfaces: one effector for each body, over the markers that carry its facets."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from femflex.effectors.noun import EffectorNoun
from femflex.effectors.surfaces.surface import Facet, Surface
from femflex.noun.problems import suggestion_text
from femflex.system.acting import ALONE, Context
from femflex.system.controller import Controller
from femflex.system.effector import Effector

COUNT, HEAD, FACETS = 0, 1, 5  # of the parameters: number of markers; numbers of the force; then ports and facets
FORM, AREA, CENTRE, REST = 0, 1, 4, 7  # of a facet, then what the force needs of it


class SurfaceForce(EffectorNoun):
    """A force on the surfaces of bodies.

    The function's parameters are the number of markers m, four numbers of the force, for each marker where its facets
    begin and how many they are (2 m), and the facets: form, area as a vector, centre, and numbers of the force.
    """

    bodies: tuple[str, ...] | None = None
    """Bodies on whose surfaces it acts. Default: all that have one."""

    label = "force on surfaces"
    accounts = ("supplied",)
    exerts = ("force", "torque")
    writes_all = True

    @abstractmethod
    def sources(self, context: Context) -> tuple[str, ...]:
        """Inputs of its function. Raises ValueError for a surrounding that does not exist."""

    def head(self) -> ArrayLike:
        """Four numbers of the force."""
        return np.zeros(4)

    @abstractmethod
    def facet_numbers(self, facet: Facet) -> ArrayLike:
        """Numbers (n,) that the force needs of a facet."""

    def effectors(self, name: str, context: Context = ALONE) -> Sequence[Effector | Controller]:
        """One effector for each body, named after both. Raises ValueError for a body without a surface."""
        surfaces: dict[str, list[Surface]] = {}
        for noun in context.nouns.values():
            if isinstance(noun, Surface):
                surfaces.setdefault(noun.body, []).append(noun)
        for body in self.bodies or ():
            if body not in surfaces:
                raise ValueError(f"body {body!r} has no surface in [surfaces]; {suggestion_text(body, surfaces)}")
        chosen = self.bodies or tuple(surfaces)
        if not chosen:
            raise ValueError("no body has a surface; give one in [surfaces]")
        inputs = self.sources(context)
        return [self._effector(f"{name}_{body}", body, surfaces[body], inputs, context) for body in chosen]

    def _effector(
        self, name: str, body: str, surfaces: Sequence[Surface], inputs: tuple[str, ...], context: Context
    ) -> Effector:
        ports: dict[str, list[Facet]] = {}
        for surface in surfaces:
            for marker, facets in surface.facets(context).items():
                ports.setdefault(marker, []).extend(facets)
        m = len(ports)
        counts = np.array([len(facets) for facets in ports.values()])
        rows = [
            np.concatenate([[facet.form], facet.area, facet.centre, np.asarray(self.facet_numbers(facet), float)])
            for facets in ports.values()
            for facet in facets
        ]
        first = FACETS + 2 * m + len(rows[0]) * np.concatenate([[0], np.cumsum(counts)[:-1]])
        table = np.stack([first, counts], axis=1).ravel()
        return Effector(
            name,
            self.act,
            tuple((body, marker) for marker in ports),
            inputs=inputs,
            accounts=self.accounts,
            exerts=self.exerts,
            parameters=np.concatenate([[float(m)], np.asarray(self.head(), float), table, *rows]),
            kind=self.label,
        )


def inputs_of(
    context: Context, name: str, kind: type[EffectorNoun], channels: Sequence[str], what: str
) -> tuple[str, ...]:
    """Channels of a surrounding as inputs. Raises ValueError where it does not exist or is of another kind."""
    if not isinstance(context.nouns.get(name), kind):
        known = [key for key, noun in context.nouns.items() if isinstance(noun, kind)]
        raise ValueError(f"found {what} {name!r}, which is not in [surroundings]; {suggestion_text(name, known)}")
    return tuple(f"{name}.{channel}" for channel in channels)
