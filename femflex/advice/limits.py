"""The limits by which advice is given, and why each has its value."""

from __future__ import annotations

# Stiffening and softening by spin, thrust and loads along a body
STIFFENED = 0.02  # of the first frequency: what linear strain leaves out of it from which a run warns
LEEWAY = 0.5  # of the limits that runs warn of: from there on strain is condensed, for what is estimated is estimated
PRINTED = 5e-5  # less than the hundredth of a per cent that is printed
BY_SPIN = 100.0  # times (spin / first frequency)^2: stiffening beyond that is not by spin
STILL = 1e-12  # rad/s: rounding

# Phase: a frequency that is a little wrong is far off after many periods
PHASE = 0.1  # rad, by which a vibration may be out after the run: a tenth of its amplitude
SWINGING = 1e-3  # of a body's size: a vibration smaller than that is not looked at, for all its phase

# Bending
BENT = 0.1  # elastic displacement over the body's size up to which linear strain is taken to hold
BENT_TURNING = 0.01  # of a bend that turns with a body: what condensed strain leaves out of it, estimated
SWUNG = 0.2  # the same for nonlinear strain: curvature is linear still, 3 % off in the tip of a cantilever there

# Buckling
NEAR = 4.0  # times its load: a body that buckles beyond it has lost at most a sixteenth of its stiffness to bends
LATE = 0.03  # of what buckles a body: a basis that buckles later by more is warned of
BOWING = 0.8  # of the estimated buckling load: from there on strain selected automatically is nonlinear
BOWED = 0.9  # of it: condensed strain, of second order, bends 1.5 % too little at 0.95, and not at all beyond 1
ALONE = 0.95  # of it, from which on a single load is to blame
NAMED = 0.05  # of it, from which on a load is named

# Curved bodies that may snap
SOFTENED = 0.5  # tangent stiffness left at a bend, over that at rest, below which a body is called curved
REACHED = 3.0  # deflection over rise that responses should reach: beyond the state snapped through, at twice the rise
PRESSED = 0.1  # of a body's rise: estimated displacement from which on its softening counts
RESPONSES = 8  # shapes from static responses: with them a curved panel snaps within 2 % of all its elements

# Truncation
SHARE = 1e-3  # of a mode's strain energy from which a static shape is kept: 0.05 % of its frequency
SERVED = 0.003  # of a body's largest amplitude, or of a joint's rate: modes excited more are served by static shapes
EXCITED = 0.01  # of the same: whose truncation error is warned of
LOWEST = 3  # elastic modes of the craft that sets are to hold
DOUBTFUL = 0.01  # change of such a frequency with richer sets, from which on it is doubtful
ROUNDING = 1e-6  # part of a static shape outside the others below which they hold it
MANY_RICHER = 600  # coordinates of the richer craft up to which its modes are sought: a second's work
CARRIED = 0.75  # of the mass; one bending mode of a uniform cantilever carries 61 %, two 80 %

# Places
DUST = 1e-9  # of a marker's largest motion in the shapes, below which a component of it is rounding

# Orbit
DRIFT = 1e-6  # of the orbital speed, 8 mm/s: what loads may change it by where the orbit is specified

# Cost of the preliminary rigid-body simulation
MOST_RATES = 200_000  # evaluations of the rate: up to a second
MANY = 400  # coordinates up to which the elastic answer is sought
