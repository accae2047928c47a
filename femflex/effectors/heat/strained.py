"""Base of nouns that strain a group of a body by its temperature."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated

import numpy as np

from femflex.body import InducedStrain, Patches
from femflex.body.induced_strain import LINES
from femflex.effectors.heat.materials import CATALOGUE
from femflex.effectors.noun import EffectorNoun, whole_body
from femflex.noun.problems import suggestion_text
from femflex.noun.table import refuse
from femflex.noun.values import Quantity
from femflex.system.acting import Context


class ThermalStrain(EffectorNoun):
    """Thermal strain of a group of lines or surfaces: expansion times the temperature, at every patch of it."""

    body: str
    """Body that is strained: one with a mesh, or a beam on admissible functions."""
    group: str | None = None
    """Group of lines or surfaces of the body. Default: "all"."""
    material: str | None = None
    """Material with the thermal properties that are not given, by a name of the catalogue."""
    expansion: Annotated[float, Quantity("1/K")] | None = None
    """Coefficient of thermal expansion. Default: that of `material`."""
    reference_temperature: Annotated[float, Quantity("K", above=0.0)] = 293.15
    """Temperature without thermal strain."""

    exerts = ()
    accounts = ("energy", "supplied")

    def property_value(self, key: str) -> float:
        """A thermal property, given or of the material. Raises ValueError where neither is."""
        value = getattr(self, key)
        if value is None and self.material is None:
            raise ValueError(f"{key} is missing; give it, or a material of the catalogue: {', '.join(CATALOGUE)}")
        return float(getattr(CATALOGUE[str(self.material)], key) if value is None else value)

    def check_material(self) -> None:
        """Refuse a material that is not in the catalogue, and properties that are missing."""
        if self.material is not None and self.material not in CATALOGUE:
            refuse(
                f"found material = {self.material!r}, which is not in the catalogue; "
                f"{suggestion_text(self.material, CATALOGUE)}"
            )
        for key in self.needed_properties():
            try:
                self.property_value(key)
            except ValueError as error:
                refuse(str(error))

    @abstractmethod
    def needed_properties(self) -> tuple[str, ...]:
        """Names of the thermal properties that it uses."""

    def needed_patches(self) -> tuple[tuple[str, str], ...]:
        """(body, group) of its patches."""
        return ((self.body, self.group or "all"),)

    def strained_groups(self) -> tuple[tuple[str, str], ...]:
        """(body, group) in which it induces strain."""
        return self.needed_patches()

    def induced(self, context: Context) -> tuple[Patches, InducedStrain]:
        """Its patches, and the forces of strain in them. Raises ValueError for a body without, and for two of them."""
        body, group = whole_body(context, self.body), self.group or "all"
        if not body.patches and not body.n_shapes:
            raise ValueError(f"body {self.body!r} is rigid, so that heat cannot bend it; give a flexible body")
        if group not in body.induced:
            raise ValueError(
                f"body {self.body!r} has no patches of group {group!r} that can be strained; heat is that of bodies "
                "with a mesh, and of beams on admissible functions (group 'all')"
            )
        for name, other in context.nouns.items():
            if isinstance(other, ThermalStrain) and other is not self and other.body == self.body:
                if "all" in (group, its := other.group or "all") or group == its:
                    raise ValueError(
                        f"group {group!r} of body {self.body!r} is heated twice, also by {name!r} in group {its!r}; "
                        "give each a group of its own"
                    )
        return body.patches[group], body.induced[group]


def strain_channels(induced: InducedStrain) -> dict[str, str]:
    """Channels of the amplitudes of strain, patch by patch, and then of their rates: name -> unit."""
    k = len(induced.f0)
    units = {name: "1" if name == "stretch" else "1/m" for name in induced.components}
    amplitudes = {f"{name}_{i + 1}": unit for i in range(k) for name, unit in units.items()}
    return amplitudes | {f"{name}_rate": "1/s" if unit == "1" else "1/(m s)" for name, unit in amplitudes.items()}


def moment_channels(induced: InducedStrain) -> dict[str, str]:
    """Channels of thermal moments, patch by patch: name -> unit; of surfaces per width."""
    k = len(induced.f0)
    if induced.components == LINES:
        return {f"moment_{axis}_{i + 1}": "N m" for i in range(k) for axis in "yz"}
    return {f"moment_{i + 1}": "N" for i in range(k)}


def moment_stiffness(induced: InducedStrain) -> np.ndarray:
    """Thermal moment per gradient of strain (k, c - 1): EI of lines; of surfaces that in one direction, per width."""
    stiffness = induced.stiffness[:, 1:]
    return np.asarray(stiffness if induced.components == LINES else stiffness / 2)
