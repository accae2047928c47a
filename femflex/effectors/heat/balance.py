"""Temperatures of a group's patches by the balance of heat (THEORY section 8), and the strain that they induce.

A thin tube of radius R and wall h has the mean temperature T and the amplitudes d_y, d_z of its first harmonic around
the section. With S the sunlight, s the unit vector to the sun, S_y = S s.y and S_z = S s.z in the section of the
deformed tube, S_t the size of (S_y, S_z) and d^2 = d_y^2 + d_z^2,

    rho c h dT/dt   = alpha S_t / pi - eps sigma (T^4 + 3 T^2 d^2 + 3/8 d^4)
    rho c h dd_y/dt = alpha S_y / 2 - [k h / R^2 + eps sigma (4 T^3 + 3 T d^2) + 4 sigma T^3 e] d_y

e is the effect of radiation between the inner walls, e = 4 eps_i / (4 - eps_i) for diffuse walls of emissivity eps_i:
the factor of view around the wall, |sin(phi/2)| / 4, has the first harmonic -1/3. A plate of thickness h has
nodes of temperature through it, equally spaced; conduction between them is that of linear finite elements,

    M dT/dt = -K T + e_front q_front + e_back q_back,   q = alpha S max(0, n.s) - eps sigma T^4

Two nodes are mean temperature and difference. The radiation of the Earth is absorbed in the same way, its infrared with
the emissivity. Strain is the expansion times T - T0, and times d/R per length across a tube; of a plate its mean, and
its gradient of least squares.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import model_validator

from femflex.arrays import Array
from femflex.body import InducedStrain, Patches
from femflex.body.patches import patch_marker
from femflex.effectors.heat.strained import ThermalStrain, moment_channels, moment_stiffness, strain_channels
from femflex.effectors.surfaces.earth_radiation import EarthRadiation
from femflex.effectors.surfaces.forces import inputs_of, surfaces_of_craft
from femflex.effectors.surfaces.shadow import LIGHT, shadow
from femflex.effectors.surfaces.surface import Facet, Surface
from femflex.effectors.surroundings.earth_disc import RINGS, SECTORS, disc_axes, disc_part
from femflex.effectors.surroundings.sun import AU, SPEED_OF_LIGHT, Sun
from femflex.kernels.compiled import inner
from femflex.kernels.entries import ACT, entry
from femflex.kernels.vectors import ZERO, Vector, add, dot, load3, load9, turn_back
from femflex.noun.problems import suggestion_text
from femflex.noun.values import Count, Duration, Quantity
from femflex.system.acting import ALONE, Context
from femflex.system.controller import Controller
from femflex.system.effector import Effector

STEFAN_BOLTZMANN = 5.670374419e-8  # W/m^2 K^4, CODATA 2018
SOLAR = 1361.0  # W/m^2 at 1 au, as for the pressure of light
MOST_NODES = 10
WARM = 300.0  # K: where the search for the first temperatures begins, and the size of the states
PATCH = 11  # numbers of a patch: normal or tangent, y and z (3 each), and moments per gradient of strain
Temperature = Annotated[float, Quantity("K", above=0.0)]
PositiveHeat = Annotated[float, Quantity("J/(kg K)", above=0.0)]


class HeatBalance(ThermalStrain, heading="thermal"):
    """Temperatures of a surface by sunlight, radiation and conduction, and the strain that they induce.

    Its lines or surfaces, with the shares of light that they absorb and their emissivity, are those of the table in
    [surfaces] with the same body and group. States of patch k of tubes: mean_k, the mean temperature, across_y_k and
    across_z_k, its amplitudes across the section; of surfaces node_1_k, from the back to the front. Channels: the
    absorbed power per area, thermal moments, and of surfaces their mean temperature and the difference of the sides.
    """

    kind: Literal["balance"]
    """Selects temperatures by the balance of heat."""
    thickness: Annotated[float, Quantity("m", above=0.0)]
    """Thickness of the wall of tubes, or of the plate or membrane."""
    density: Annotated[float, Quantity("kg/m^3", above=0.0)] | None = None
    """Mass per volume, for its heat capacity. Default: that of `material`."""
    specific_heat: PositiveHeat | None = None
    """Heat capacity per mass. Default: that of `material`."""
    conductivity: Annotated[float, Quantity("W/(m K)", least=0.0)] | None = None
    """Conductivity around the section of tubes, and through the thickness of plates. Default: that of `material`."""
    inner_emissivity: Annotated[float, Quantity(least=0.0, most=1.0)] = 0.0
    """Emissivity of the inner wall of tubes, between whose sides heat is radiated; 0: none is."""
    nodes: Annotated[int, Count(1, MOST_NODES)] = 2
    """Nodes through the thickness of plates and membranes. One node: the mean temperature alone."""
    initial: Temperature | Literal["equilibrium"] = "equilibrium"
    """Temperature at t = 0, or "equilibrium": that at which no temperature changes there."""
    sun: str = "sun"
    """The sun, a name in [surroundings]."""
    shadow_period: Duration | None = None
    """Time between two updates of the shadow that parts of the craft cast on one another. Default: no shadow."""
    earth: str | None = None
    """A table of [earth_radiation], whose albedo and infrared are absorbed too. Default: none."""

    label = "thermal"
    derived = (
        *("expansion_", "density_", "specific_heat_", "conductivity_", "patches", "n_nodes", "is_tube", "is_shaded"),
        *("radius", "absorbed_front", "absorbed_back", "emissivity_front", "emissivity_back"),
        *("has_earth", "albedo", "infrared", "earth_radius", "table"),
    )

    @model_validator(mode="after")
    def _known_material(self) -> HeatBalance:
        self.check_material()
        return self

    def needed_properties(self) -> tuple[str, ...]:
        """Expansion, and what the balance of heat needs."""
        return ("expansion", "density", "specific_heat", "conductivity")

    def numbers(self) -> dict[str, ArrayLike]:
        """Its fields, with those of its material; the others follow from the body."""
        zeros = dict.fromkeys(self.derived, 0.0)
        properties = {f"{key}_": self.property_value(key) for key in self.needed_properties()}
        return super().numbers() | zeros | properties | {"initial": 0.0}

    def effectors(self, name: str, context: Context = ALONE) -> Sequence[Effector | Controller]:
        """Its effector, and where shadow counts the controller that finds the lit shares. Raises ValueError."""
        patches, induced = self.induced(context)
        facets = self._facets(context)
        inputs = list(inputs_of(context, self.sun, Sun, ("x", "y", "z", "pressure"), "sun"))
        radiation = self._earth_radiation(context)
        if radiation is not None:
            inputs += radiation.sources(context)
        first: list[Controller] = []
        if self.shadow_period is not None:
            surfaces = surfaces_of_craft(context)
            sampled = shadow(f"{name}_shadow", self.sun, self.shadow_period, surfaces, (self.body,), context)
            all_facets = [facet for own in surfaces[self.body].values() for facet in own]
            markers = [marker for marker, own in surfaces[self.body].items() for _ in own]
            assert len(all_facets) == len(markers)
            numbers = list(sampled.memory_names())
            inputs += [numbers[LIGHT * markers.index(self._marker(k))] for k in range(len(facets))]
            first = [sampled]
        return [*first, self._effector(name, context, patches, induced, facets, inputs, radiation)]

    def _marker(self, k: int) -> str:
        return patch_marker(self.group or "all", k)

    def _facets(self, context: Context) -> list[Facet]:
        """The facets of its patches. Raises ValueError where no surface has the same body and group."""
        of_body = {key: noun for key, noun in context.nouns.items() if isinstance(noun, Surface)}
        for noun in of_body.values():
            if noun.body == self.body and (noun.group or "all") == (self.group or "all"):
                return [facet for own in noun.facets(context).values() for facet in own]
        raise ValueError(
            f"group {self.group or 'all'!r} of body {self.body!r} has no surface in [surfaces], which says what it "
            "absorbs and radiates; give one with the same body and group"
        )

    def _earth_radiation(self, context: Context) -> EarthRadiation | None:
        if self.earth is None:
            return None
        noun = context.nouns.get(self.earth)
        if not isinstance(noun, EarthRadiation):
            known = [key for key, other in context.nouns.items() if isinstance(other, EarthRadiation)]
            text = suggestion_text(self.earth, known)
            raise ValueError(f"found earth = {self.earth!r}, which is not in [earth_radiation]; {text}")
        return noun

    def _effector(
        self,
        name: str,
        context: Context,
        patches: Patches,
        induced: InducedStrain,
        facets: Sequence[Facet],
        inputs: Sequence[str],
        radiation: EarthRadiation | None,
    ) -> Effector:
        k, tube, n = len(facets), patches.dimension == 1, self.nodes
        front, back = facets[0].front, facets[0].back
        values = self.numbers() | {
            "patches": k, "n_nodes": n, "is_tube": tube, "is_shaded": self.shadow_period is not None,
            "radius": facets[0].gap if tube else 0.0,
            "absorbed_front": 1.0 - front.specular - front.diffuse, "emissivity_front": front.emissivity,
            "absorbed_back": 0.0 if back is None else 1.0 - back.specular - back.diffuse,
            "emissivity_back": 0.0 if back is None else back.emissivity,
        }  # fmt: skip
        if radiation is not None:
            values |= {"has_earth": True, "albedo": radiation.albedo, "infrared": radiation.infrared}
            values |= {"earth_radius": context.radius}
        sizes = self.number_sizes()
        head = np.concatenate([np.ravel(np.asarray(values[key], float)) for key in sizes])[:-1]
        stiffness = moment_stiffness(induced)
        rows = [[*induced.axes[i].ravel(), *stiffness[i], *[0.0] * (2 - stiffness.shape[1])] for i in range(k)]
        of_patch = ("mean", "across_y", "across_z") if tube else tuple(f"node_{j + 1}" for j in range(n))
        states = {f"{state}_{i + 1}": "K" for i in range(k) for state in of_patch}
        channels = {f"absorbed_{i + 1}": "W/m^2" for i in range(k)} | moment_channels(induced)
        if not tube:
            channels |= {f"{key}_{i + 1}": "K" for i in range(k) for key in ("mean", "difference")}
        start = WARM if self.initial == "equilibrium" else float(self.initial)
        first = [start, 0.0, 0.0] if tube else [start] * n
        return Effector(
            name,
            self.act,
            tuple((self.body, self._marker(i)) for i in range(k)),
            states=states,
            z0=np.array(first * k),
            sizes=np.full(len(states), WARM),
            inputs=tuple(inputs),
            channels=strain_channels(induced) | channels,
            accounts=self.accounts,
            exerts=self.exerts,
            strained=(self.body, self.group or "all"),
            n_strains=induced.f0.shape[0] * induced.f0.shape[1],
            settles=self.initial == "equilibrium",
            jacobian=heat_jacobian,
            parameters=np.concatenate([head, np.ravel(rows), *self._through_thickness()]),
            kind=self.label,
        )

    def _through_thickness(self) -> tuple[Array, ...]:
        """Of a plate with n nodes from back to front: -M^-1 K (n, n), M^-1 at back and front, mean and gradient (n,).

        M and K are those of linear elements, per area.
        """
        n, h = self.nodes, self.thickness
        capacity = self.property_value("density") * self.property_value("specific_heat") * h
        if n == 1:
            return np.zeros(1), np.full(1, 1.0 / capacity), np.full(1, 1.0 / capacity), np.ones(1), np.zeros(1)
        M, K, step = np.zeros((n, n)), np.zeros((n, n)), h / (n - 1)
        for i in range(n - 1):
            part = np.ix_([i, i + 1], [i, i + 1])
            M[part] += capacity / (n - 1) * np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
            K[part] += self.property_value("conductivity") / step * np.array([[1.0, -1.0], [-1.0, 1.0]])
        inverse, z = np.linalg.inv(M), np.linspace(-h / 2, h / 2, n)
        mean = M.sum(axis=0) / capacity
        gradient = 12.0 / h**2 * (M @ z) / capacity
        return tuple(
            np.asarray(a, float).ravel() for a in (-inverse @ K, inverse[:, 0], inverse[:, -1], mean, gradient)
        )


P, IN, _ = HeatBalance.places()


@inner
def absorbed(s: Vector, light: float, heat: float, p: Array, patch: int) -> Vector:
    """Absorbed power per area of light and infrared from direction s, axes of the patch's marker.

    Of tubes its mean and its amplitudes along y and z; of surfaces that of front and back.
    """
    front = p[P.absorbed_front] * light + p[P.emissivity_front] * heat
    if p[P.is_tube] > 0.0:
        y, z = dot(s, load3(p, patch + 3)), dot(s, load3(p, patch + 6))
        return front * math.sqrt(y * y + z * z) / math.pi, 0.5 * front * y, 0.5 * front * z
    c = dot(s, load3(p, patch + 6))
    back = p[P.absorbed_back] * light + p[P.emissivity_back] * heat
    return front * max(0.0, c), back * max(0.0, -c), 0.0


@inner
def absorbed_heat(k: int, seen: Array, p: Array) -> Vector:
    """Absorbed power per area of patch k, as `absorbed`."""
    m, patch = int(p[P.patches]), P.table + PATCH * k
    C, inputs = load9(seen, 3 * m + 9 * k), 18 * m
    lit, to_sun = seen[inputs + 3] * SPEED_OF_LIGHT, load3(seen, inputs)
    if p[P.is_shaded] > 0.0:
        sources = 4
        if p[P.has_earth] > 0.0:
            sources += 6 if p[P.albedo] == 0.0 else 10
        lit *= seen[inputs + sources + k]
    q = absorbed(turn_back(C, to_sun), lit, 0.0, p, patch)
    if p[P.has_earth] > 0.0:
        place, radius, sun, reflected = load3(seen, inputs + 4), p[P.earth_radius], ZERO, 0.0
        if dot(place, place) <= radius * radius:
            return q
        axes = disc_axes(place, load3(seen, inputs + 7))
        if p[P.albedo] > 0.0:
            sun = load3(seen, inputs + 10)
            reflected = p[P.albedo] * SOLAR * (AU / seen[inputs + 13]) ** 2
        for ring in range(RINGS):
            for sector in range(SECTORS):
                direction, ground, share = disc_part(ring, sector, place, radius, axes)
                light = share * reflected * max(0.0, dot(ground, sun))
                q = add(q, absorbed(turn_back(C, direction), light, share * p[P.infrared], p, patch))
    return q


@inner
def inner_exchange(p: Array) -> float:
    """Radiation between inner walls over that of a black surface, for the first harmonic."""
    e = p[P.inner_emissivity]
    return 4.0 * e / (4.0 - e)


@HeatBalance.kernel
def heat_balance(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Inputs: direction to the sun, pressure of its light; those of the Earth's radiation; lit share of every patch."""
    p = parameters
    m, n, tube = int(p[P.patches]), int(p[P.n_nodes]), p[P.is_tube] > 0.0
    n_z, c = (3, 3) if tube else (n, 2)
    capacity, expansion = p[P.density_] * p[P.specific_heat_] * p[P.thickness], p[P.expansion_]
    rates, strains = 6 * m, 6 * m + m * n_z
    more = strains + 2 * m * c  # absorbed power, moments, then temperatures of surfaces
    moments = more + m
    for k in range(m):
        q, at = absorbed_heat(k, seen, p), n_z * k
        patch, strain, rate = P.table + PATCH * k, strains + c * k, strains + c * (m + k)
        if tube:
            T, y, w = z[at], z[at + 1], z[at + 2]
            d2, e = y * y + w * w, p[P.emissivity_front] * STEFAN_BOLTZMANN
            lost = e * (T**4 + 3.0 * T * T * d2 + 0.375 * d2 * d2)
            inside = STEFAN_BOLTZMANN * inner_exchange(p) * 4.0 * T**3
            back = p[P.conductivity_] * p[P.thickness] / p[P.radius] ** 2 + e * (4.0 * T**3 + 3.0 * T * d2) + inside
            out[rates + at] = (q[0] - lost) / capacity
            out[rates + at + 1], out[rates + at + 2] = (q[1] - back * y) / capacity, (q[2] - back * w) / capacity
            out[strain] = expansion * (T - p[P.reference_temperature])
            out[rate] = expansion * out[rates + at]
            for i in range(1, 3):
                out[strain + i] = expansion * z[at + i] / p[P.radius]
                out[rate + i] = expansion * out[rates + at + i] / p[P.radius]
                out[moments + 2 * k + i - 1] = out[strain + i] * p[patch + 8 + i]
            out[more + k] = q[0]
        else:
            A = P.table + PATCH * m
            low, high = A + n * n, A + n * n + n
            mean, gradient = high + n, high + 2 * n
            front = q[0] - p[P.emissivity_front] * STEFAN_BOLTZMANN * z[at + n - 1] ** 4
            rear = q[1] - p[P.emissivity_back] * STEFAN_BOLTZMANN * z[at] ** 4
            T = 0.0
            for i in range(n):
                change = p[high + i] * front + p[low + i] * rear
                for j in range(n):
                    change += p[A + n * i + j] * z[at + j]
                out[rates + at + i] = change
                T += p[mean + i] * z[at + i]
                out[rate] += expansion * p[mean + i] * change
                out[strain + 1] += expansion * p[gradient + i] * z[at + i]
                out[rate + 1] += expansion * p[gradient + i] * change
            out[strain] = expansion * (T - p[P.reference_temperature])
            out[more + k] = q[0] + q[1]
            out[moments + k] = out[strain + 1] * p[patch + 9]
            out[moments + m + 2 * k], out[moments + m + 2 * k + 1] = T, z[at + n - 1] - z[at]


@entry(ACT)
def heat_jacobian(t: float, seen: Array, z: Array, parameters: Array, out: Array) -> None:
    """Derivative (n_z, n_z) of the rates of the temperatures by the temperatures."""
    p = parameters
    m, n, tube = int(p[P.patches]), int(p[P.n_nodes]), p[P.is_tube] > 0.0
    n_z = 3 if tube else n
    size = m * n_z
    capacity = p[P.density_] * p[P.specific_heat_] * p[P.thickness]
    for k in range(m):
        at = n_z * k
        if tube:
            T, y, w = z[at], z[at + 1], z[at + 2]
            d2, e = y * y + w * w, p[P.emissivity_front] * STEFAN_BOLTZMANN
            inside = STEFAN_BOLTZMANN * inner_exchange(p)
            back = p[P.conductivity_] * p[P.thickness] / p[P.radius] ** 2 + e * (4.0 * T**3 + 3.0 * T * d2)
            back += 4.0 * inside * T**3
            by_T = e * (12.0 * T * T + 3.0 * d2) + 12.0 * inside * T * T
            out[size * at + at] = -e * (4.0 * T**3 + 6.0 * T * d2) / capacity
            for i in range(1, 3):
                d = z[at + i]
                out[size * at + at + i] = -e * (6.0 * T * T + 1.5 * d2) * d / capacity
                out[size * (at + i) + at] = -by_T * d / capacity
                for j in range(1, 3):
                    out[size * (at + i) + at + j] = (
                        -(e * 6.0 * T * d * z[at + j] + (back if i == j else 0.0)) / capacity
                    )
        else:
            A = P.table + PATCH * m
            low, high = A + n * n, A + n * n + n
            front = 4.0 * p[P.emissivity_front] * STEFAN_BOLTZMANN * z[at + n - 1] ** 3
            rear = 4.0 * p[P.emissivity_back] * STEFAN_BOLTZMANN * z[at] ** 3
            for i in range(n):
                for j in range(n):
                    out[size * (at + i) + at + j] = p[A + n * i + j]
                out[size * (at + i) + at + n - 1] -= p[high + i] * front
                out[size * (at + i) + at] -= p[low + i] * rear
