"""Base of forces on surfaces: one effector for each body, over the markers that carry its facets."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike

from femflex.arrays import Array
from femflex.effectors.noun import EffectorNoun
from femflex.effectors.surfaces.surface import Facet, Surface
from femflex.noun.problems import suggestion_text
from femflex.system.acting import ALONE, Context
from femflex.system.controller import Controller
from femflex.system.effector import Effector

COUNT, HEAD, FACETS = 0, 1, 5  # of the parameters: number of markers; numbers of the force; then ports and facets
FORM, NORMAL, SIZE, CENTRE, REST = 0, 1, 4, 5, 8  # of a facet, then what the force needs of it


class SurfaceForce(EffectorNoun):
    """A force on the surfaces of bodies.

    The function's parameters are the number of markers m, four numbers of the force, for each marker where its facets
    begin and how many they are (2 m), and the facets: form, unit normal, area, centre, and numbers of the force.
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

    def head(self, context: Context) -> ArrayLike:
        """Four numbers of the force."""
        return np.zeros(4)

    @abstractmethod
    def facet_numbers(self, facet: Facet) -> ArrayLike:
        """Numbers (n,) that the force needs of a facet."""

    def effectors(self, name: str, context: Context = ALONE) -> Sequence[Effector | Controller]:
        """As `on_bodies`."""
        return self.on_bodies(name, context)

    def on_bodies(self, name: str, context: Context) -> list[Effector]:
        """One effector for each body, named after both. Raises ValueError for a body without a surface."""
        inputs, head, surfaces = self.sources(context), self.head(context), surfaces_of_craft(context)
        chosen = [body for body in self.chosen_bodies(surfaces) if surfaces[body]]
        return [self._effector(f"{name}_{body}", body, surfaces[body], inputs, head) for body in chosen]

    def chosen_bodies(self, surfaces: Mapping[str, object]) -> tuple[str, ...]:
        """The bodies on which it acts, of those with surfaces. Raises ValueError for a body without, and for none."""
        for body in self.bodies or ():
            if body not in surfaces:
                raise ValueError(f"body {body!r} has no surface in [surfaces]; {suggestion_text(body, surfaces)}")
        if not surfaces:
            raise ValueError("no body has a surface; give one in [surfaces]")
        return self.bodies or tuple(surfaces)

    def _effector(
        self, name: str, body: str, ports: Mapping[str, Sequence[Facet]], inputs: tuple[str, ...], head: ArrayLike
    ) -> Effector:
        m = len(ports)
        counts = np.array([len(facets) for facets in ports.values()])
        rows = [
            np.concatenate([[facet.form], *_normal_and_size(facet.area), facet.centre, self.facet_numbers(facet)])
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
            parameters=np.concatenate([[float(m)], np.asarray(head, float), table, *rows]),
            kind=self.label,
        )


def _normal_and_size(area: Array) -> tuple[Array, Array]:
    """Unit normal (3,) and area (1,) of an area as a vector."""
    size = np.linalg.norm(area)
    return area / (size or 1.0), np.array([size])


def surfaces_of_craft(context: Context) -> dict[str, dict[str, list[Facet]]]:
    """Body -> marker -> the facets that move with it, of all surfaces but those that raise errors of their own."""
    out: dict[str, dict[str, list[Facet]]] = {}
    for noun in context.nouns.values():
        if isinstance(noun, Surface):
            facets_of_body = out.setdefault(noun.body, {})
            with suppress(ValueError):
                for marker, facets in noun.facets(context).items():
                    facets_of_body.setdefault(marker, []).extend(facets)
    return out


def inputs_of(
    context: Context, name: str, kind: type[EffectorNoun], channels: Sequence[str], what: str
) -> tuple[str, ...]:
    """Channels of a surrounding as inputs. Raises ValueError where it does not exist or is of another kind."""
    if not isinstance(context.nouns.get(name), kind):
        known = [key for key, noun in context.nouns.items() if isinstance(noun, kind)]
        raise ValueError(f"found {what} {name!r}, which is not in [surroundings]; {suggestion_text(name, known)}")
    return tuple(f"{name}.{channel}" for channel in channels)
