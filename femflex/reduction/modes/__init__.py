"""Sets of shapes by linear solves: vibration, buckling, Craig-Bampton, static and residual ones; their damping."""
