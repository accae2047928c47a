"""The same of a beam on admissible functions (`load_buckling`): against functions enough, and all that it can do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from femflex.body import FlexibleBody
from femflex.body.symmetric import hessian
from femflex.reduction.admissible import beam_body
from femflex.reduction.load_buckling import LoadBuckling, multiple
from femflex.reduction.uniform_beam import BeamFunctions, UniformBeam

Array = NDArray[np.float64]

ENOUGH = 6  # polynomials of each field: 1e-4 in the load at which a cantilever tips over
THIN = 1e-4  # radius of gyration over length of a section that is given no inertia


def beam_buckling(
    beam: UniformBeam, functions: BeamFunctions, force: Array, moment: Array, either: bool = False
) -> LoadBuckling:
    """LoadBuckling of a beam under a dead force (3,) [N] and moment (3,) [N m] at its tip, body axes;
    either: or one the other way."""
    whole = whole_beam(beam, functions)
    own = beam_body(beam, replace(functions, axial=0), strain="condensed")
    return LoadBuckling(*(body_buckling(body, force, moment, either) for body in (whole, own)))


def whole_beam(beam: UniformBeam, functions: BeamFunctions) -> FlexibleBody:
    """The condensed beam with functions enough to buckle as it does."""
    bent = max(functions.y, functions.z)
    enough = BeamFunctions(*(max(ENOUGH, bent),) * 2, 0, max(ENOUGH, bent), "polynomial", functions.ends)
    turning = beam if beam.ry or beam.rz else replace(beam, ry=THIN * beam.length, rz=THIN * beam.length)
    return beam_body(turning, enough, strain="condensed")


def body_buckling(body: FlexibleBody, force: Array, moment: Array, either: bool = False) -> float:
    """Least positive multiple of a dead load at the tip at which a condensed body buckles from its linear answer.

    V1 + lambda (6 V2 d - f.A), with d = V1^-1 f and the load's work f.A on what follows.
    """
    n, tip = body.n_modes, body.markers["tip"]
    f = tip.phi.T @ force + tip.psi.T @ moment
    V1 = (body.strain.V1 + body.strain.V1.T) / 2
    answer: Array = np.asarray(np.linalg.solve(V1, f[:n]), float)
    change = hessian(body.strain.V2, answer, 3) - np.tensordot(f[n:], body.slaves, axes=1)
    ratios = linalg.eigvalsh(change, V1)
    return multiple(float(min(ratios[0], -ratios[-1]) if either else ratios[0]))
