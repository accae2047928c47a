"""Static equilibrium of a structure under steady loads, by its full nonlinear elastic force.

Newton's method with a shift (Levenberg and Marquardt) minimises the total potential; the shift is dropped when the
tangent is positive. For a cable that is slack at first and hardly stretches, the minimum lies in a narrow valley.
Where tethers and membranes start without tension, their elastic stiffness is therefore first reduced so far that loads
strain them by a tenth, and then raised by factors to its own value.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from femflex.arrays import Array, IntArray
from femflex.fem.deflected import deflected, tension_blocks
from femflex.fem.internal_force import InternalForce
from femflex.fem.structure import Structure
from femflex.fem.tension.strain import PRINCIPAL, UNITS, TensionStrain
from femflex.reduction.boundary.rigid import Groups, held_dofs
from femflex.reduction.boundary.supported import factors, negative_pivots, supported
from femflex.reduction.preload.loads import Loads, Preload, loads_of_preload
from femflex.warning import warn_of_physics

CONVERGED = 1e-11  # largest unbalanced force over the largest force on a dof
FIRST_STRAIN = 0.1  # by which loads strain tethers and membranes with their first elastic stiffness
STAGE = 10.0  # factor of stiffness from stage to stage
STEPS = 200  # Newton steps of a stage at most
SHIFTED = 1e-3  # first shift, of the typical stiffness over the mass of a dof
LEAST_SHIFT = 1e-12  # of the same, below which it is dropped
ROUNDING, RELAXED = 1e-14, 1e-8  # of the elastic stiffness, and of the given stress: tension up to which it is zero
SLACK = 1e-6  # of the largest tension: compression up to which it counts as an error of discretisation


def static_equilibrium(structure: Structure, clamp: Groups, preload: Preload | None = None) -> Structure:
    """The structure about its static equilibrium under the preload and its initial stress, with the clamps fixed.

    Its mesh has the deflected shape, its strain blocks the stress; f0 balances the loads, which must act on the
    body in its system too. Exact for tethers and membranes at any displacement (`femflex.fem.deflected`). Warns where
    tethers are slack or membranes wrinkled. Raises ValueError where no equilibrium is found, and where tethers or
    membranes have no tension in it.
    """
    held = held_dofs(structure, clamp)
    loads = loads_of_preload(structure, preload)
    x = equilibrium(structure, held, loads)
    found = deflected(structure, x) if x.any() else structure
    refuse_untensioned(found, max((float(np.abs(b.stress).max()) for b in tension_blocks(structure)), default=0.0))
    warn_if_slack(found)
    found.known["at rest", held.tobytes()] = (True,)
    if preload is not None:
        found.known["preloaded", held.tobytes()] = (True,)
    return found


def is_preloaded(structure: Structure, held: IntArray) -> bool:
    """Whether external loads balance the elastic force of a structure with the dofs of numbers held (k,) fixed."""
    return is_known(structure, "preloaded", held)


def is_known(structure: Structure, what: str, held: IntArray) -> bool:
    """Whether a structure is known to be in a state, "at rest" or "preloaded", with the dofs of numbers held (k,)
    fixed, or some of them."""
    keys = [key[1] for key in structure.known if key[0] == what]
    return any(np.isin(np.frombuffer(key, np.int64), held).all() for key in keys)


def equilibrium(structure: Structure, held: IntArray, loads: Loads) -> Array:
    """Displacements (n_dof,) [m, rad] at which elastic forces balance the loads, zero at the fixed dofs `held` (k,)."""
    free = np.delete(np.arange(structure.n_dof), held)
    elastic = structure.internal_force
    x = np.zeros(structure.n_dof)
    scale = float(np.abs(np.concatenate([loads.F[free], structure.f0])).max(initial=0.0))
    if np.abs((structure.f0 - loads.F)[free]).max(initial=0.0) <= CONVERGED * scale:
        return x
    if not tension_blocks(structure):
        return _newton(elastic, loads, free, x, scale, structure.M)
    for factor in _stages(structure, loads, free):
        strain = [
            replace(block, elastic=block.elastic * factor) if isinstance(block, TensionStrain) else block
            for block in structure.strain
        ]
        own = InternalForce(strain, structure.T) if factor < 1.0 else elastic
        x = _newton(own, loads, free, x, scale, structure.M)
    return x


def _stages(structure: Structure, loads: Loads, free: IntArray) -> list[float]:
    """Factors of the elastic stiffness of tethers and membranes, ascending to 1; 1 alone where they have tension."""
    blocks = tension_blocks(structure)
    if all((block.lowest_tension() > 0).all() for block in blocks):
        return [1.0]
    pull = float(np.abs(loads.F[free]).sum()) / 3
    size = float(np.linalg.norm(np.ptp(structure.mesh.points, axis=0)))
    stiff = max(
        float(block.elastic[..., 0, 0].max()) * (1.0 if len(block.linear_map) == 1 else size) for block in blocks
    )
    first = pull / (FIRST_STRAIN * stiff)
    if not 0 < first < 1:
        return [1.0]
    return [*np.geomspace(first, 1.0, 1 + int(np.ceil(np.log(1 / first) / np.log(STAGE))))]


def _newton(elastic: InternalForce, loads: Loads, free: IntArray, x: Array, scale: float, M: sparse.csr_array) -> Array:
    """Displacements (n_dof,) of least total potential, by Newton steps from x (n_dof,)."""
    masses = M.diagonal()[free]
    mass = sparse.diags_array(np.maximum(masses, 1e-6 * masses.max()))
    potential = elastic.energy(x) - loads.work(x)
    force = elastic.force(x)
    shift, best = None, np.inf
    for _ in range(STEPS):
        left = (loads.forces(x) - force)[free]
        best = float(np.abs(left).max(initial=0.0))
        if best <= CONVERGED * max(scale, float(np.abs(force).max(initial=0.0))):
            return x
        K = (elastic.tangent(x) - loads.S)[free][:, free].tocsr()
        typical = float(K.diagonal().max() / mass.diagonal().mean())
        if shift is None:
            shift = SHIFTED * typical
        while True:
            try:
                solver = factors((K + shift * mass).tocsr())
                dx = solver.solve(left) if not negative_pivots(solver) else None
            except RuntimeError:
                dx = None
            if dx is not None and np.isfinite(dx).all():
                trial = x.copy()
                trial[free] += dx
                new, pull = elastic.energy(trial) - loads.work(trial), elastic.force(trial)
                rest = float(np.abs((loads.forces(trial) - pull)[free]).max(initial=0.0))
                if new < potential or rest < best:
                    break
            if shift > 1e6 * typical:
                return _without_residual(x, best, max(scale, float(np.abs(force).max(initial=0.0))))
            shift = max(4.0 * shift, LEAST_SHIFT * typical)
        x, potential, force = trial, new, pull
        shift = shift / 10 if shift > LEAST_SHIFT * typical else 0.0
    return _without_residual(x, best, max(scale, float(np.abs(force).max(initial=0.0))))


def _without_residual(x: Array, left: float, scale: float) -> Array:
    """x if the unbalanced force `left` [N] is rounding; raises ValueError otherwise."""
    if left <= 1e3 * CONVERGED * scale:
        return x
    raise ValueError(
        f"no static equilibrium was found: the unbalanced force is {left:.3g} N, and the largest load {scale:.3g} N. "
        "Check supports, slack tethers and the direction of the loads, or make the mesh closer to the shape under load."
    )


def refuse_untensioned(structure: Structure, given: float = 0.0) -> None:
    """Raise ValueError when a tether or membrane has no tension anywhere, or only rounding of the given stress."""
    for block in tension_blocks(structure):
        if float(block.stress.max()) <= max(ROUNDING * float(block.elastic.max()), RELAXED * given):
            raise ValueError(
                f"{block.family} on group {block.group!r} has no tension, and therefore no transverse stiffness; give "
                "it a prestress between fixed supports, or a preload (weight, spin, orbit or forces) that puts it "
                "under tension"
            )


def refuse_slack(structure: Structure, held: IntArray) -> None:
    """Raise ValueError when slack tethers or wrinkled membranes leave no positive stiffness with the dofs of
    numbers held (k,) fixed."""
    on = supported(structure, held)
    try:
        negative = negative_pivots(factors(on.K_stiff))
    except RuntimeError:  # a pivot that is zero: the modes show it
        return
    if negative:
        raise ValueError(
            f"slack tethers or wrinkled membranes leave {negative} motions of the structure unstable; raise the "
            "tension (prestress or preload) until none of them is under compression"
        )


def warn_if_slack(structure: Structure) -> None:
    """Warn of each tether that is slack, and each membrane that is wrinkled, in its initial stress, and where."""
    for block in tension_blocks(structure):
        lowest = block.lowest_tension()
        largest = float(np.abs(block.stress).max())
        if lowest.min() >= -SLACK * largest:
            continue
        part = float(block.weight[lowest < -SLACK * largest].sum() / block.weight.sum())
        s = len(block.linear_map)
        at = ", ".join(f"{c:.4g}" for c in np.broadcast_to(block.places, (*lowest.shape, 3))[lowest == lowest.min()][0])
        state, what = ("slack", "length") if s == 1 else ("wrinkled", "area")
        warn_of_physics(
            f"{block.family} on group {{body_or_joint!r}} is {state} over {{part:.2%}} of its {what}: its "
            f"{PRINCIPAL[s]} falls to {{value:.4g}} {UNITS[s]} at ({{at}}), below zero, and the elements carry "
            "that compression.",
            body_or_joint=block.group,
            value=lowest.min(),
            limit=0.0,
            remedy="Raise the tension, or move the supports",
            part=part,
            at=at,
        )
