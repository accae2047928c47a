"""Effectors at work: how compiled code calls their functions, their events, and sampled controllers."""
