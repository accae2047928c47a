"""Materials: *ELASTIC of every type and *DENSITY under *MATERIAL, in SI, with the overrides of the case."""

from __future__ import annotations

import numpy as np

from femflex.arrays import Array
from femflex.decks.abaqus.model import AbaqusModel, location_of
from femflex.decks.materials import Elastic
from femflex.mesh.formats.abaqus_keywords import Keyword

IGNORED_BEHAVIOUR = {  # keywords of a material that a linear elastic structure ignores
    "PLASTIC": "the material stays linear", "CYCLIC HARDENING": "the material stays linear",
    "HYPERELASTIC": "the material needs *ELASTIC here", "HYPERFOAM": "the material needs *ELASTIC here",
    "CREEP": "the material stays linear", "VISCOELASTIC": "the material stays elastic",
    "EXPANSION": "thermal strains are left out", "CONDUCTIVITY": "heat conduction is left out",
    "SPECIFIC HEAT": "heat conduction is left out", "DAMPING": "give damping in the case",
    "DEPVAR": "user materials are left out", "USER MATERIAL": "user materials are left out",
    "DAMAGE INITIATION": "the material stays linear", "DAMAGE EVOLUTION": "the material stays linear",
    "DEFORMATION PLASTICITY": "the material stays linear", "NO COMPRESSION": "the material stays linear",
    "ACOUSTIC MEDIUM": "fluids are left out; the mass of the fluid is missing",
    "FAIL STRESS": "strength is left out", "FAIL STRAIN": "strength is left out",
}  # fmt: skip
MATERIAL_KEYWORDS = {"ELASTIC", "DENSITY", *IGNORED_BEHAVIOUR}
COUNTS = {"ISOTROPIC": 2, "ISO": 2, "LAMINA": 4, "ENGINEERING CONSTANTS": 9, "ORTHO": 9, "ORTHOTROPIC": 9,
          "ANISO": 21, "ANISOTROPIC": 21}  # fmt: skip
NAMES = {  # of the constants, as keys of overrides
    "ISOTROPIC": ("E", "nu"),
    "LAMINA": ("E1", "E2", "nu12", "G12", "G13", "G23"),
    "ENGINEERING CONSTANTS": ("E1", "E2", "E3", "nu12", "nu13", "nu23", "G12", "G13", "G23"),
}


class Materials:
    """The materials of a deck by name in capitals."""

    def __init__(self, model: AbaqusModel) -> None:
        self._model = model
        self._by_name: dict[str, Elastic] = {}
        self._unusable: dict[str, str] = {}
        materials: list[tuple[Keyword, list[Keyword]]] = []
        current: list[Keyword] | None = None
        for _, keyword in model.flat.keywords:
            if keyword.name == "MATERIAL":
                current = []
                materials.append((keyword, current))
            elif keyword.name.endswith("SECTION"):
                current = None
            elif current is not None and keyword.name in MATERIAL_KEYWORDS:
                current.append(keyword)
        for head, keywords in materials:
            self._read_material(head, keywords)

    def __call__(self, name: str, where: str) -> Elastic:
        """The material with this name. Raises ValueError if the deck has no such elastic material."""
        key = name.upper()
        if key in self._unusable:
            raise ValueError(f"{where}: {self._unusable[key]}")
        if key not in self._by_name:
            names = sorted(material.name for material in self._by_name.values())
            raise ValueError(f"{where}: material {name!r} is not in the deck; it has {names or 'none'}.")
        return self._by_name[key]

    def all_materials(self) -> list[Elastic]:
        """All elastic materials."""
        return list(self._by_name.values())

    def _read_material(self, head: Keyword, keywords: list[Keyword]) -> None:
        """Read a material by its keyword and those that describe it."""
        name, findings, parts = head.parameter("name"), self._model.findings, {k.name: k for k in keywords}
        findings.use("*MATERIAL")
        for keyword in keywords:
            if keyword.name in IGNORED_BEHAVIOUR:
                findings.unused(f"*{keyword.name}", IGNORED_BEHAVIOUR[keyword.name], location_of(keyword))
            else:
                findings.use(f"*{keyword.name}")
        if "ELASTIC" in parts:
            self._model.attempt(head, lambda: self._add(name, parts))
            return
        nonlinear = [word for word in parts if word not in ("DENSITY", "DEPVAR", "EXPANSION", "DAMPING")]
        problem = f"*{nonlinear[0]} and no *ELASTIC, which alone is read" if nonlinear else "no *ELASTIC"
        self._unusable[name.upper()] = f"material {name!r} ({head.location()}) has {problem}; give one."

    def _add(self, name: str, parts: dict[str, Keyword]) -> None:
        u, keyword = self._model.units, parts["ELASTIC"]
        kind = " ".join((keyword.parameter("type") or "ISOTROPIC").upper().split())
        kind = {"ISO": "ISOTROPIC", "ORTHOTROPIC": "ORTHO", "ANISOTROPIC": "ANISO"}.get(kind, kind)
        if kind not in COUNTS:
            self._unusable[name.upper()] = (
                f"material {name!r} has *ELASTIC, TYPE={kind}, which is not read; give {sorted(COUNTS)}."
            )
            return
        words = [(k, word) for k, row in enumerate(keyword.data) for word in (row + [""] * 8)[:8]]
        constants = [keyword.real(word, k, "an elastic constant") for k, word in words]
        count = COUNTS[kind]
        lines = -(-(count + 1) // 8) if count > 6 else 1
        if len(keyword.data) > lines:
            self._model.findings.unused(
                "*ELASTIC at further temperatures", "the values of the first line are used", location_of(keyword)
            )
        rho = 0.0
        if "DENSITY" in parts and parts["DENSITY"].data:
            rho = parts["DENSITY"].real(parts["DENSITY"].data[0][0], 0, "a density") * u.density
        c = constants[:count]
        if len(c) < count:
            raise keyword.error(f", TYPE={kind} has {len(c)} constants; material {name!r} needs {count}.")
        p, matrix = u.pressure, None
        values = {"density": rho}
        if kind in NAMES:
            c = [*constants[:6], 0.0, 0.0][:6] if kind == "LAMINA" else c
            values |= {n: x * (1.0 if n.startswith("nu") else p) for n, x in zip(NAMES[kind], c, strict=True)}
        else:
            matrix = _matrix(kind, np.array(c) * p)
        values = self._model.override([name], values, keyword.location())
        if values["density"] < 0 or values.get("E", values.get("E1", 1.0)) <= 0:
            raise keyword.error(
                f": material {name!r} has {values}; moduli must be positive and the density not negative."
            )
        if "E" in values:
            values["G"] = values["E"] / (2 * (1 + values["nu"]))
        for key in ("G13", "G23") if kind == "LAMINA" else ():
            values[key] = values[key] or values["G12"]
        self._by_name[name.upper()] = Elastic(name, f"material {name!r}", keyword.location(), values, matrix)


def _matrix(kind: str, c: Array) -> Array:
    """Elastic matrix in the order 11, 22, 33, 23, 13, 12, from Abaqus' order 11, 22, 33, 12, 13, 23."""
    D = np.zeros((6, 6))
    if kind == "ORTHO":
        D[0, 0], D[0, 1], D[1, 1], D[0, 2], D[1, 2], D[2, 2], D[3, 3], D[4, 4], D[5, 5] = c
    else:
        rows = [(i, j) for j in range(6) for i in range(j + 1)]  # columns of the upper triangle
        for (i, j), value in zip(rows, c, strict=True):
            D[i, j] = value
    D = D + np.triu(D, 1).T
    order = [0, 1, 2, 5, 4, 3]
    return D[np.ix_(order, order)]
