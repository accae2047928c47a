"""Inertia of shapes: mass moments, accelerations, effective mass, orders."""
