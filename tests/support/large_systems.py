"""Texts of cases with many flexible bodies: a free chain of links, and a hub with booms all around it."""

import numpy as np

BEAM = """
kind = "analytic"
length = 1.0
mass = 0.5
EA = 1e6
EIy = 10.0
EIz = 10.0
GJ = 30.0
functions = { y = 1, z = 1, joints = [] }
initial = { amplitudes = [0.02] }
"""
HEAD = """
title = "{title}"
[run]
duration = {duration}
samples = 5
rtol = 1e-11
[attitude]
{attitude}
"""


def chain(n: int, duration: float = 1.0) -> str:
    """A chain of n links that floats freely, folded a little, its hinges about y and z in turn."""
    parts = [HEAD.format(title=f"chain of {n} links", duration=duration, attitude="rates = [0, 0.001, 0.002]")]
    parts += [f"[bodies.link{k}]{BEAM}" for k in range(n)]
    for k in range(1, n):
        axis, rate = "yz"[k % 2], 0.03 * np.sin(k)
        parts.append(
            f'[[joints]]\nkind = "revolute"\nparent = "link{k - 1}"\nparent_marker = "tip"\nchild = "link{k}"\n'
            f'child_marker = "root"\naxis = "{axis}"\nangle = {0.2 * np.cos(k):.6f}\nrate = {rate:.6f}\n'
        )
    return "\n".join(parts)


def star(n: int, duration: float = 1.0) -> str:
    """A tumbling hub with n booms welded around its rim."""
    parts = [HEAD.format(title=f"hub with {n} booms", duration=duration, attitude="rates = [0.3, 0.2, 1.0]")]
    parts.append('[bodies.hub]\nkind = "rigid"\nmass = 50\ninertia = [20, 20, 30]\n')
    for k in range(n):
        c, s = np.cos(2 * np.pi * k / n), np.sin(2 * np.pi * k / n)
        parts.append(
            f"[bodies.hub.markers.rim{k}]\nposition = [{0.5 * c:.9f}, {0.5 * s:.9f}, 0]\n"
            f"orientation = {{ x = [{c:.9f}, {s:.9f}, 0], z = [0, 0, 1] }}\n"
        )
    parts += [f"[bodies.boom{k}]{BEAM}" for k in range(n)]
    parts += [
        f'[[joints]]\nkind = "weld"\nparent = "hub"\nparent_marker = "rim{k}"\nchild = "boom{k}"\n' for k in range(n)
    ]
    return "\n".join(parts)
