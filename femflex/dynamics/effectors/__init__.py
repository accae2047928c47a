"""Evaluation of effectors: compiled calls of their functions, their events, and sampled controllers."""
