"""Dynamic relaxation: the motion from rest, stopped at each peak of its kinetic energy, comes to a stable equilibrium.

It needs no stiffness, so that it finds where slack cables hang (A. S. Day, An introduction to dynamic relaxation, The
Engineer 219 (1965) 218; M. R. Barnes, Int. J. Space Structures 14 (1999) 89). Steps are those of leapfrog's method; the
fastest vibration, which limits them, is estimated from the change of the accelerations.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from femflex.arrays import Array
from femflex.dynamics.motion.increments import advanced
from femflex.linear.steady import Steady

LONGEST = 2e-3  # step over usual sizes
SHARE = 0.5  # of 1 / omega, omega the frequency that is estimated: half of it is the limit of stability
UNSTABLE = 2.0  # omega^2 h^2 from which a step is taken again, shorter
MEMORY = 0.98  # of omega^2 from step to step
CHECKED = 500  # steps after which a motion must have turned round
AT_REST, CLOSER = 1e-4, 0.01  # forces over those at the start at which a state is tried; over those of the last trial
MOST = 50_000  # steps
TINY = 1e-300


def relaxed_states(problem: Steady, q: Array) -> Iterator[Array]:
    """Coordinates (n_q,) on the way from q to rest, ever closer; none with loops or with states of effectors.

    They end where the motion has not turned round within many steps, as of a craft that is pushed away.
    """
    model = problem.full
    if model.constraints is not None or model.n_z or problem.prescribed.all():
        return
    u, free, squared, turned = np.zeros(model.n_u), ~problem.prescribed, 0.0, False

    def acceleration(q: Array, u: Array) -> Array:
        rate = model.state_rate(0.0, np.concatenate([q, u]))[model.n_q : model.n_q + model.n_u]
        return np.asarray(np.where(free, rate, 0.0))

    def force(q: Array) -> Array:
        return np.where(free, model.bias(0.0, model.at_rest(q)), 0.0)

    a, sizes = acceleration(q, u), problem.sizes
    limit = AT_REST * float(np.abs(force(q) * sizes).max())
    for k in range(1, MOST + 1):
        h = min(SHARE / np.sqrt(squared + TINY), np.sqrt(LONGEST / (np.abs(a / sizes).max() + TINY)))
        h *= min(1.0, LONGEST / (np.abs((u + h * a) / sizes).max() * h + TINY))
        faster = u + h * a
        move = h * faster
        ahead = advanced(model, q, move)
        b = acceleration(ahead, faster)
        seen = float(np.linalg.norm((b - a) / sizes) / (np.linalg.norm(move / sizes) + TINY))
        if not np.isfinite(seen):
            return
        if seen * h * h > UNSTABLE and seen > squared:
            squared = seen
            continue
        squared = max(seen, MEMORY * squared)
        left = force(ahead)
        peak = float(left @ faster) > 0.0
        turned |= peak
        q, u, a = ahead, np.zeros(model.n_u) if peak else faster, b
        if float(np.abs(left * sizes).max()) < limit:
            limit *= CLOSER
            yield q
        if k % CHECKED == 0:
            if not turned:
                return
            turned = False
