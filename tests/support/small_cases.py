"""Texts of small cases that several tests of studies share."""

HUB_AND_BAR = """
title = "rigid"
[run]
orbits = 1
[orbit]
kind = "specified"
perigee_altitude = "600 km"
[bodies.hub]
kind = "rigid"
mass = 200
inertia = [50, 40, 45]
[bodies.bar]
kind = "rigid"
mass = 2
inertia = [3, 0.1, 3]
[[joints]]
kind = "weld"
parent = "hub"
child = "bar"
[stability]
inertia = "hub"
"""


def sprung_wheels(stiffness: float, output: str) -> str:
    """Two wheels on axles with springs, 8 N m/rad at the first and this at the second; the first turns."""
    return f"""
title = "two wheels"
[run]
duration = "1 s"
{output}
[bodies.a]
kind = "rigid"
mass = 3
inertia = [2, 2, 2]
[bodies.b]
kind = "rigid"
mass = 3
inertia = [2, 2, 3]
[[joints]]
kind = "revolute"
child = "a"
name = "first"
stiffness = 8
rate = "0.5 rad/s"
[[joints]]
kind = "revolute"
child = "b"
name = "second"
stiffness = {stiffness}
"""


def clamped_rod(functions: str) -> str:
    """A clamped beam of 2 m, as a body and a joint more."""
    return f"""
[bodies.rod]
kind = "analytic"
length = 2
mass = 1
EA = 1e7
EIy = 2000
EIz = 3000
GJ = 1500
radius = 0.02
functions = {functions}
strain = "linear"
[[joints]]
kind = "weld"
child = "rod"
"""
