"""Records of effectors in the table of a model (see femflex.system.effector)."""

from __future__ import annotations

import numpy as np

from femflex.dynamics.lowering.layout import record_reader

EFFECTOR = np.dtype(
    [
        (name, "i8")
        for name in (
            "n_markers", "n_freedoms", "n_inputs", "n_z", "n_channels",
            "act", "jacobian",  # addresses; 0: none
            "clears",  # whether its numbers are set to zero before its function is called
            "markers", "freedoms", "inputs",  # table: PORT and HANDLE records, places of inputs from that of z
            "z",  # place of its first state in z
            "parameters", "sizes",  # pool
            "before", "after",  # effectors before and after it of its group; -1: none (see `grouped`)
            "seen", "out",  # work: what is seen; what is written, twice
            "pushed",  # work: force (3) and torque (3) of its group up to it, inertial components
            "trial", "matrix",  # work (n_z,), (n_z, n_z + 1): for Newton's method
        )
    ]
)  # fmt: skip
PORT = np.dtype(
    [
        (name, "i8")
        for name in (
            "body", "place", "shape", "spin", "bends",  # as for marker P of a joint
            "motion",  # work: place from the body's origin, body components (3); tangent T of its own turn (9)
        )
    ]
)  # fmt: skip
HANDLE = np.dtype([(name, "i8") for name in ("body", "freedom", "q", "u")])
N_EFFECTOR, N_PORT, N_HANDLE = (len(record.names or ()) for record in (EFFECTOR, PORT, HANDLE))

effector_at, port_at, handle_at = (record_reader(record) for record in (EFFECTOR, PORT, HANDLE))
