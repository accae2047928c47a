"""What kernels are written in: lanes, vectors, turns, profiles, and formulas without branches."""
