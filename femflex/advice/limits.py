"""The limits by which advice is given, and why each has its value."""

from __future__ import annotations

from femflex.body import FlexibleBody

# Stiffening and softening by spin, thrust and loads along a body
FREQUENCY_CHANGE = 0.02  # change of the first frequency that linear strain omits, above which a run warns
CHOICE_FRACTION = 0.5  # of the limits for warnings: above it strain is condensed, because the motion is estimated
SMALLEST_PRINTED = 5e-5  # below the last printed digit, a hundredth of a per cent
SPIN_SHARE = 0.01  # (rate / first frequency)^2 over the gain below which the spin is not the cause of the stiffening
SPIN_STIFFENING_RATIO = 100.0  # stiffening over (spin / first frequency)^2 above which spin is not its cause
ZERO_RATE = 1e-12  # rad/s: rounding

# Phase: a small error of a frequency adds up over many periods
PHASE_ERROR = 0.1  # rad, phase error of a vibration at the end of the run: a tenth of its amplitude
SMALL_VIBRATION = 1e-3  # of a body's size: the phase of a smaller vibration is not assessed

# Bending
LINEAR_ABOVE = 0.1  # largest elastic displacement over the body's size for linear strain
SPINNING_ERROR = 0.01  # estimated relative error of the deflection of a spinning body by condensed strain
SLOW_RATIO = 0.15  # rate over first frequency below which condensed strain errs negligibly in a spinning body
STRETCHING_RATIO = 30.0  # frequency of a shape over the first above which it is a stretching mode of a slender body
DIVERGENCE_RATIO = 10.0  # elastic displacement over the body's size, or present length, above which the motion diverges
# Same ratio for condensed and nonlinear strain: their curvature is linear, so a cantilever's tip has an error of 3 %
NONLINEAR_INVALID_ABOVE = 0.2

# Buckling
BUCKLING_FACTOR = 4.0  # buckling load over load: above it a body loses at most a sixteenth of its stiffness to bending
BASIS_OVERESTIMATE = 0.03  # relative excess of a basis' buckling load above which a run warns
# Load over buckling load above which a run warns: condensed strain deflects 1.5 % too little at 0.95, and not at all
# past 1
CONDENSED_INVALID_ABOVE = 0.9
SINGLE_LOAD_SHARE = 0.95  # of the total ratio above which a single load is reported as the cause
LISTED_SHARE = 0.05  # of the total ratio above which a load is listed

SLACK = 1e-3  # of the largest tension: compression below the accuracy of its estimate

# Curved bodies that may snap
SOFTENING_RATIO = 0.5  # tangent stiffness under deflection over that at rest below which a body counts as curved
RESPONSE_REACH = 3.0  # deflection of responses over rise: snap-through leads to twice the rise
DISPLACEMENT_OF_RISE = 0.1  # estimated displacement over a body's rise above which its softening matters
RESPONSES = 8  # shapes from static responses: a curved panel then snaps within 2 % of its finite elements

# Truncation
ENERGY_SHARE = 1e-3  # of a mode's strain energy above which a static shape is retained: 0.05 % of its frequency
EXCITATION_SHARE = 0.003  # of a body's largest amplitude, or of a joint's rate: modes above it get static shapes
HISTORY_ERROR = 0.02  # error of a body's elastic motion over its peak, or of a joint's rate, above which a run warns
LOWEST_MODES = 3  # elastic modes of the craft that sets must represent
FREQUENCY_ERROR = 0.01  # estimated error of such a frequency, where nothing excites it, above which a run warns
ROUNDING = 1e-6  # part of a static shape outside the others below which they contain it
MANY_SHAPES = 600  # coordinates of a craft up to which its modes are computed: about a second

# Markers
MARKER_ROUNDING = 1e-9  # of a marker's largest motion in the shapes, below which a component of it is rounding

# Bodies without inertia about a line
LINE_INERTIA_RATIO = 1e-9  # least over largest moment of inertia about the centre of mass: mass on a line
SINGULAR_MASS = 1e-13  # eigenvalue of the scaled mass matrix below which it is singular
NOTABLE_SHARE = 0.1  # of a body in such a motion

# Energy and rotation sets
ENERGY_CHANGE = 0.01  # of the largest energy: a change without cause above which a run warns
SINGULARITY_DISTANCE = 0.05  # rad; distance to the singularity of a rotation set below which a run warns

# Orbit
ORBIT_CHANGE = 1e-6  # of the orbital speed, 8 mm/s: largest change by loads on a specified orbit

# Cost of the preliminary rigid-body simulation
MOST_RATES = 200_000  # evaluations of the rate: up to a second
MANY_COORDINATES = 400  # coordinates up to which the elastic response is computed

# Places at which bends are sought
MANY_POINTS, MIXTURES = 800, 60  # points spread over a body; mixtures of its shapes, whose farthest points are added
TINY = 1e-300  # m, instead of the size of a shape that moves nothing
BLOCK_NUMBERS = 2_000_000  # numbers that the displacements of all points in some rows may take at once

# Preliminary rigid-body simulation
ESTIMATE_RTOL = 1e-6  # of the rigid motion
ESTIMATE_ROWS = 2000  # instants, uniform over the run
LOOP_FACTOR = 4  # times fewer instants for a system with loops, which are solved at each
PER_PERIOD = 12  # instants for each period of prescribed sines
MOST_ROWS = 12_000
PARTS = 64  # the motion is computed part by part, until MOST_RATES rates are spent

# Tethers and membranes
WATCHED_ELEMENTS = 9  # elements of a member that are watched, from its first to its last

# Bends of spinning bodies
SPINNING_COEFFICIENT, MAX_SPINNING_COEFFICIENT = 0.42, 0.9  # c over (rate / first frequency)^2, and the largest c
# Limit of the rate over the first frequency, which is 0 for a wire
FAST_RATIO = 10.0

# Energy
NO_ENERGY = 1e-30  # J: rounding

# Bends
LARGE_DISPLACEMENT = 0.1  # displacement over length above which linear strain is doubtful

# Divergence
LARGEST_RATES = {"rad/s": 1e5, "m/s": 3e6}  # ten times what flywheels reach; a hundredth of the speed of light
LARGEST_SLIDE = 1e7  # m, of bodies of one craft from one another; the longest tethers have reached 3e4 m

# Commands
FULL_THRUST = 1.01  # level above which a run warns: the command exceeds full thrust or has another unit

# Size of a run
MOST_OUTPUT_ROWS = 10**8  # more output rows than this are a mistake

# Controllers
MOST_CALLS = 1e7  # of a controller or sensor in a run: at 0.2 ms each, half an hour

# Models built again
SAME_MODEL = 1e-6  # relative; energies of the rebuilt model and of the file

# Resumed runs
SAME_TIME = 1e-12  # relative: rounding of an output time


def division_remedy(body: FlexibleBody) -> str:
    """Text on how to divide a body: mesh lines are cut into segments, other bodies are divided by hand."""
    kinds = {part.kind for part in body.strain_field}
    if "admissible" in body.kinds:
        return "give it a mesh instead of functions and cut its member into segments"
    if "line" in kinds:
        return "cut the member into segments"
    if kinds:
        return f"divide its {'plates' if 'plate' in kinds else 'solids'} into several bodies, welded to each other"
    return "divide it into several bodies, welded to each other"
