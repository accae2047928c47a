"""Every mistake a user makes in a case file gets its sentence: where, what was found, what is known, what to do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from femflex.case import CaseError, read_case
from femflex.pipeline.decisions import build_system

RATE, TORQUE = 'rates = ["2 deg/s", 0, 0.01]', "torque = [[0, 0, 1], [0, 0, 1]]\ntimes = [0, 2]"
ORBIT = "[orbit]\nperigee_altitude = '331 km'\n"
HIT = "kind = 'rigid'\nmass = 1\ninertia = [1, 1, 1]\n"

# old text -> new text (several with a list), then the fragments the message must have; old "" appends
IN_THE_TEXT = [
    # TOML
    ("mass = 200", "mass = 200 kg", "line 23", "text goes in quotes"),
    ("mass = 200", "mass = 200\nmass = 300", "line 24", "overwrite a value"),
    ("", "[bodies.hub]\n" + HIT, "line 48", "'bodies', 'hub'", "twice"),
    ("[run]", "[run", "line 4", "expected ']'"),
    # keys
    ("duration =", "durtion =", "run.durtion", "did you mean 'duration'?"),
    ("ratio =", "rtio =", "bodies.boom.damping.rtio", "did you mean 'ratio'?"),
    ("[attitude]", "[atitude]", "atitude", "did you mean 'attitude'?"),
    ("mass = 200", "mass = 200\nmesh = 'boom.inp'", "bodies.hub.mesh", "belongs to kind = 'flexible'"),
    ('kind = "weld"', 'kind = "weld"\naxis = [0, 0, 1]', "joints[boom].axis", "belongs to kind = 'revolute'"),
    ("mass = 200\n", "", "bodies.hub.mass", "missing"),
    ('kind = "rigid"\n', "", "bodies.hub", "'kind' is missing", "'rigid', 'flexible'"),
    ('kind = "rigid"', 'kind = "ridgid"', "found kind = 'ridgid'", "did you mean 'rigid'?"),
    ('kind = "weld"', 'kind = "hinge"', "joints[boom]", "'hinge'", "'revolute'"),
    ('[run]\nduration = "10 s"\noutput_step = 0.05\n', "", "run: this key is missing"),
    ("[[joints]]", "[joints.first]", "joints", "a table", "[[joints]]"),
    ("", "[expect]\na = 3\n", "expect.a", "3 (a number)", "expected a table"),
    ('title = "hub with a boom"', "title = 5", "title", "5 (a number)", "text in quotes"),
    # units
    ('"30 mm"', '"30 deg"', "sections.tube.outer_radius", "an angle", "expected a length"),
    (
        "[[0, 0, 1], [0, 0, 1]]",
        "[['1 kg m^2', 0, 0], [0, 0, 0]]",
        "loads[push].torque",
        "a moment of inertia",
        "expected a torque",
    ),
    ('"30 mm"', '"30 mmm"', "'mmm' is not known", "did you mean 'mm'?"),
    ('"30 mm"', '"30 metrs"', "did you mean 'metre'?"),
    ('"30 mm"', '"30 mm +"', "'mm +' cannot be read"),
    ('"30 mm"', '"30 m^9^9^9^9"', "'m^9^9^9^9' cannot be read"),
    ('"30 mm"', '"30"', "without a unit", "in m"),
    ('"30 mm"', '"0,03 m"', "decimal comma", "'0.03 m'"),
    ("mass = 200", "mass = 'heavy'", "bodies.hub.mass", "does not begin with a number", "'1 kg'"),
    (RATE, 'rates = ["2 Hz", 0, 0]', "attitude.rates", "a rate per second", "'rev/s'"),
    # kinds of values
    ("mass = 200", "mass = true", "true (a truth value)", "a number in kg"),
    ("mass = 200", "mass = [200]", "[200] (a list)"),
    ('family = "beam"', "family = { s = [0, 1] }", "bodies.boom.members[BOOM].family", "a table"),
    ("mass = 200", "mass = 2024-01-01", "2024-01-01 (a date)"),
    ("mass = 200", "mass = 1e300", "bodies.hub.mass", "found 1e+300 kg", "between 1e-30 and 1e+30"),
    ("mass = 200", "mass = 1e-300", "found 1e-300 kg", "must be zero, or"),
    ("mass = 200", "mass = 1" + 400 * "0", "found inf; the number must be finite"),
    ("mass = 200", "mass = 1" + 5000 * "0", "a whole number of thousands of digits"),
    ("mass = 200", "mass = '" + 5000 * "x" + "'", "bodies.hub.mass", "of 5000 characters"),
    ('"70 GPa"', "1e300", "materials.aluminium.E", "found 1e+300 Pa"),
    ("", "[expect]\na = { channel = 'q', value = 1e300 }\n", "expect.a.value", "found 1e+300"),
    ("", "a = " + 5000 * "[" + 5000 * "]", "nests tables or lists too deeply", "at most 20 levels"),
    ("", "[a" + 3000 * ".a" + "]", "a: found tables or lists nested deeper than 20"),
    ("mass = 200", "mass = " + 30 * "[" + 30 * "]", "bodies: found tables or lists nested deeper than 20"),
    ("mass = 200", "mass = nan", "bodies.hub.mass", "found nan", "finite"),
    ('duration = "10 s"', "duration = inf", "run.duration", "found inf"),
    ('duration = "10 s"', "duration = '1e400 s'", "run.duration", "found inf"),
    ("position = [0.5, 0, 0]", "position = [0.5, 0]", "bodies.hub.markers.left.position", "2 entries", "a list of 3"),
    ("position = [0.5, 0, 0]", "position = [0.5, -1e30, 0]", "markers.left.position", "-1e+30 m", "at least -1e+12 m"),
    ("[[0, 0, 1], [0, 0, 1]]", "[[0, 0, 1], [0, 1]]", "loads[push].torque", "row 2: found 2 entries"),
    ("modes = 4", "modes = 4.5", "bodies.boom.reduction.modes", "4.5", "a whole number"),
    ("modes = 4", "modes = true", "bodies.boom.reduction.modes", "a truth value", "a whole number"),
    ("", "[pictures]\nmovie = 'yes'\n", "pictures.movie", "true or false"),
    # names
    ("[bodies.hub]", '[bodies."h\u00fcb"]', "found 'h\u00fcb' (text)", "letters, digits, - and _ (ASCII)"),
    ("markers.left =", 'markers."." =', "bodies.hub.markers.'.'", "points only inside"),
    ("markers.tip =", 'markers."Ober Kante" =', "letters, digits", "gives that as its group: edge = {"),
    ('kind = "weld"', 'kind = "weld"\nname = ""', "joints[boom].name", "letters, digits"),
    ('kind = "weld"', 'kind = "weld"\nname = "."', "joints[.].name", "points only inside"),
    ('kind = "weld"', 'kind = "weld"\nname = "a\\u0000b"', "joints[a\\x00b].name", "letters, digits"),
    ('kind = "weld"', 'kind = "weld"\nname = "a/b"', "joints[a/b].name", "letters, digits"),
    ('kind = "weld"', 'kind = "weld"\nname = "a."', "joints[a.].name", "letters, digits"),
    ('kind = "weld"', 'kind = "weld"\nname = ["a"]', "['a'] (a list)", "text in quotes"),
    (
        "",
        "[bodies.'hub.far']\n" + HIT + "[[joints]]\nkind = 'weld'\nparent = 'hub'\nchild = 'hub.far'\n",
        "'hub' and 'hub.far' of two of the bodies",
        "rename one of them",
    ),
    # impossible numbers
    ("mass = 200", "mass = -200", "found -200 kg", "above 0 kg"),
    ("mass = 200", "mass = 0", "found 0 kg", "above 0 kg"),
    ('"2 mm"', '"-2 mm"', "sections.tube.thickness", "found -0.002 m", "at least 0 m"),
    ('"2 mm"', "0", "thickness of Tube is 0", "must be positive"),
    ('"2 mm"', '"40 mm"', "thickness of Tube is 0.04 m", "make the wall thinner"),
    ('"2700 kg/m^3"', "-2700", "materials.aluminium.density", "at least 0 kg/m^3"),
    ("nu = 0.33", "nu = 0.5", "materials.aluminium.nu", "below 0.5"),
    ('"70 GPa"', '"-70 GPa"', "materials.aluminium.E", "above 0 Pa"),
    ('"0.5 %"', "1.5", "bodies.boom.damping.ratio", "below 1"),
    ("[120, 100, 140]", "[-120, 100, 140]", "not positive definite", "-120, 100, 140 kg m^2"),
    ("[120, 100, 140]", "[0, 0, 0]", "not positive definite"),
    (
        "[120, 100, 140]",
        "[120, 100, 240]",
        "triangle inequality",
        "100, 120, 240 kg m^2",
        "sum to at least the largest",
    ),
    ("[120, 100, 140]", "[[120, 1, 0], [0, 100, 0], [0, 0, 140]]", "not symmetric", "(1, 2) is 1, (2, 1) is 0"),
    ("[120, 100, 140]", "[120, 100, 140, 1]", "4 entries", "a list of 3"),
    ("[120, 100, 140]", "[120, nan, 140]", "entry 2: found nan"),
    # run
    ('duration = "10 s"', "duration = 0", "run.duration", "above 0 s"),
    ('duration = "10 s"', 'duration = "-10 s"', "found -10 s", "above 0 s"),
    ("output_step = 0.05", "output_step = 20", "20 s, longer than the duration of 10 s"),
    ("output_step = 0.05", "output_step = 0", "run.output_step", "above 0 s"),
    ("output_step = 0.05", "output_step = 1e-12", "run.output_step", "1e+13 rows", "GB are free"),
    ("output_step = 0.05", "output_step = 0.05\nsamples = 10", "output_step and samples together"),
    ("output_step = 0.05", "samples = 1", "run.samples", "at least 2"),
    ("output_step = 0.05", "samples = 1" + 60 * "0", "run.samples", "1" + 56 * "0", "at most 1000000000"),
    ("output_step = 0.05", "rtol = 0", "run.rtol", "above 0"),
    ("output_step = 0.05", "rtol = 2", "run.rtol", "at most 0.1"),
    ("output_step = 0.05", 'integrator = "rk45"', "run.integrator", "'rk45'", "'dop853'"),
    ('duration = "10 s"', "orbits = 2", "run.orbits", "needs an orbit"),
    ('duration = "10 s"', "duration = 3\norbits = 2", "duration and orbits together"),
    # orbit and attitude
    ("", ORBIT + "eccentricity = 1\n", "orbit.eccentricity", "below 1"),
    ("", ORBIT + "eccentricity = -0.1\n", "orbit.eccentricity", "at least 0"),
    ("", "[orbit]\nsemi_major_axis = '6400 km'\neccentricity = 0.1\n", "618.1 km below the surface"),
    ("", ORBIT + "semi_major_axis = '7000 km'\n", "perigee_altitude and semi_major_axis together"),
    ("", "[orbit]\neccentricity = 0.1\n", "none of perigee_altitude, semi_major_axis"),
    ("", ORBIT + "kind = 'none'\n", "kind = 'none' together with perigee_altitude"),
    ("[attitude]", "[attitude]\nframe = 'orbital'", "attitude.frame", "without an orbit", "'inertial'"),
    ("[attitude]", "[attitude]\nframe = 'spinning'", "without spin"),
    ("[attitude]", "[attitude]\nheld = true", "held = true together with rates"),
    ("[attitude]", "[attitude]\nnominal_axes = ['x', 'z', 'y']", "['x', 'z', 'y']", "right-handed"),
    ("[attitude]", "[attitude]\nnominal_axes = ['x', 'y', 'w']", "attitude.nominal_axes[2]", "'w'", "'-x'"),
    (
        "[attitude]",
        "[attitude]\nnominal_axes = ['x', 'y']",
        "attitude.nominal_axes[2]",
        "this entry is missing; found 2 entries",
    ),
    ("[attitude]", "[attitude]\nsequence = 'xxz'", "attitude.sequence", "did you mean 'zxz'?"),
    ("[attitude]", "[attitude]\npitch = 0.1\nangles = [0, 0, 0]", "angles and pitch together"),
    ("[attitude]", "[attitude]\npitch = 0.1\nsequence = 'zxz'", "turns about one axis twice"),
    ("[attitude]", "[attitude]\nsequence = 'extrnsic xyz'", "attitude.sequence", "did you mean 'extrinsic xyz'?"),
    ("[attitude]", "[attitude]\nrotation = 'rodrigue'", "attitude.rotation", "did you mean 'rodrigues'?"),
    ("[attitude]", "[attitude]\nrotation = 3", "known are 'euler_parameters', 'modified_rodrigues'", "'extrinsic xyz'"),
    ("[attitude]", "[attitude]\nrebase = true", "'euler_parameters' has no singularity", "leave `rebase` out"),
    ("[attitude]", "[attitude]\nrebase = 1", "attitude.rebase", "true or false"),
    (RATE, "held = true\nrebase = true", "held = true together with rebase"),
    ("[attitude]", "[attitude]\nrotation = 'zxz'", "joint 'base-hub' starts at the singularity", "'zxz'", "rebase"),
    ("[attitude]", "[attitude]\nyaw = '30 deg'", "attitude.yaw", "in the inertial frame", "angles = ["),
    ("[attitude]", "[attitude]\nangles = [0, 0, '90 deg']\nrotation = 'xyz'", "singularity of its rotation set 'xyz'"),
    (
        "[attitude]",
        "[attitude]\nangles = [0, 0, '180 deg']\nrotation = 'rodrigues'",
        "singularity of its rotation set 'rodrigues'",
    ),
    ('kind = "weld"', 'kind = "spherical"\nrotation = "yxy"', "joint 'hub-boom' starts at the singularity", "'yxy'"),
    ("[attitude]", "[attitude]\nroot = 'hib'", "attitude.root", "did you mean 'hub'?"),
    ("[attitude]", "[attitude]\nroot = 'boom'", "already has a joint"),
    # meshes and structure
    ('mesh = "boom.inp"', 'mesh = "bom.inp"', "bodies.boom.mesh", "does not exist", "'boom.inp'"),
    ('mesh = "boom.inp"', 'mesh = "."', "bodies.boom.mesh", "a folder"),
    ('mesh = "boom.inp"', 'mesh = "craft.toml"', "bodies.boom", ".toml is not a known mesh format", ".msh"),
    ('mesh = "boom.inp"', 'mesh = "boom.inp"\nmesh_unit = "furlong"', "bodies.boom.mesh_unit", "'mm'"),
    ('group = "BOOM"', 'group = "boom"', "bodies.boom.members[boom].group", "did you mean 'BOOM'?", "'ROOT', 'TIP'"),
    ('clamp = "ROOT"', 'clamp = "ROTO"', "bodies.boom.reduction.clamp", "no group of boom.inp", "did you mean 'ROOT'?"),
    ('group = "TIP"', 'group = "END"', "bodies.boom.markers.tip.group", "known are 'BOOM', 'NOTHING', 'ROOT', 'TIP'"),
    ('group = "TIP"', 'group = "NOTHING"', "bodies.boom.markers.tip.group", "'NOTHING' of the mesh is empty"),
    ('group = "BOOM"', 'group = "TIP"', "'TIP' is a group of points; cells are needed"),
    ('clamp = "ROOT"', "clamp = []", "no group to clamp", "'free_free'"),
    ('clamp = "ROOT"', 'clamp = {ROOT=["x","y","z"]}', "bodies.boom", "3 rigid motions"),
    ('clamp = "ROOT"', 'clamp = {ROOT=["u"]}', "bodies.boom.reduction.clamp", "x, y, z, rx, ry, rz"),
    (
        'clamp = "ROOT"',
        "clamp = {ROOT = {components = [], axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}",
        "bodies.boom.reduction.clamp",
        "found [] (a list) at group 'ROOT'; name components of x, y, z, rx, ry, rz",
    ),
    ('clamp = "ROOT"', "clamp = {ROOT = {symmetry = [0, 0, 0]}}", "bodies.boom.reduction.clamp", "not all zero"),
    (
        'clamp = "ROOT"',
        "clamp = {ROOT = {symmetry = [0, 1]}}",
        "bodies.boom.reduction.clamp",
        "symmetry at group 'ROOT'",
    ),
    ('clamp = "ROOT"', "clamp = {ROOT = {mirror = [0, 1, 0]}}", "bodies.boom.reduction.clamp", "a support is"),
    (
        'clamp = "ROOT"',
        'clamp = {ROOT = {components = ["x"], axes = [[1, 0, 0], [1, 1, 0], [0, 0, 1]]}}',
        "bodies.boom.reduction.clamp",
        "not at right angles",
    ),
    (
        'clamp = "ROOT"',
        'clamp = {ROOT = {components = ["x"], axes = 3}}',
        "bodies.boom.reduction.clamp",
        "three directions at right angles",
    ),
    ('clamp = "ROOT"', "clamp = 3", "bodies.boom.reduction.clamp", "expected a group name"),
    ("modes = 4", "modes = 400", "400 modes", "at most 33"),
    ("modes = 4", "modes = 0", "bodies.boom.reduction.modes", "at least 1"),
    ('method = "cantilever"', 'method = "guyan"', "method = 'guyan'", "'craig_bampton'"),
    ('method = "cantilever", ', "", "'method' is missing", "'free_free'"),
    ('family = "beam"', 'family = "bream"', "bodies.boom.members[BOOM].family", "did you mean 'beam'?"),
    ('family = "beam"', 'family = "beam", options={ordr=4}', "no option 'ordr'", "'order'"),
    ('section = "tube"', 'section = "tubes"', "bodies.boom.members[BOOM].section", "did you mean 'tube'?"),
    ('section = "tube", ', "", "bodies.boom", "has no section; name one"),
    ('material = "aluminium"', 'material = "aluminum"', "not in [materials]", "did you mean 'aluminium'?"),
    (', material = "aluminium"', "", "bodies.boom", "needs a material"),
    ('ratio = "0.5 %"', "ratio = 0.1, mass = 1", "ratio together with mass"),
    ('"2 mm"', "{s=[0,2,1], values=[0.001,0.002,0.003]}", "arc lengths [0.0, 2.0, 1.0] m", "increase"),
    ('"2 mm"', "{s=[0,2], values=[0.001,0.002]}", "covers s = 0 to 2 m", "extend the table"),
    ('"2 mm"', "{s=[0,3], values=[0.001,nan]}", "sections.tube.thickness", "found nan"),
    ('"2 mm"', '{formula="0.002/(s - s)"}', "is inf at s = 0.0130467 m", "finite along the whole member"),
    ('"2 mm"', '{formula="sqrt(s, s)"}', "thickness of Tube: formula 'sqrt(s, s)'", "takes 1 argument; found 2"),
    ('"2 mm"', '{formula="' + 5000 * "s+" + 's"}', "10001 characters; at most 2000", "a table instead"),
    ('"2 mm"', '{formula="0.002 * __import__(1)"}', "'__import__(1)'", "it may use"),
    ('"2 mm"', "{s=[0,3]}", "keys ['s']", "formula"),
    # markers
    ('{ group = "TIP" }', '{ group = "TIP", position = [3, 0, 0] }', "group and position in marker 'tip'"),
    (
        '{ group = "TIP" }',
        "{ position = [3000, 0, 0] }",
        "bodies.boom.markers.tip.position",
        "2997 m from the nearest point",
    ),
    ("position = [0.5, 0, 0]", 'group = "x"', "marker 'left' of a rigid body", "give position"),
    ("position = [0.5, 0, 0]", "orientation = [[1,0,0],[0,1,0],[0,0,-1]]", "not a rotation", "determinant -1"),
    ("position = [0.5, 0, 0]", "orientation = {x=[1,0,0], y=[2,0,0]}", "must not be parallel"),
    ("position = [0.5, 0, 0]", 'orientation = "x"', "bodies.hub.markers.left.orientation", "3 x 3 matrix"),
    # tree
    ('parent = "hub"', 'parent = "hup"', "joints[boom].parent", "did you mean 'hub'?"),
    ('child = "boom"', 'child = "beam"', "joints[beam].child", "known are 'boom', 'hub'"),
    ('parent = "hub"', 'parent = "boom"', "joined to itself"),
    ('child_marker = "ROOT"', 'child_marker = "root"', "joints[boom].child_marker", "did you mean 'ROOT'?"),
    ('parent_marker = "left"', 'parent_marker = "right"', "no marker of body 'hub'", "'left', 'origin'"),
    ('parent = "hub"\n', "", "parent_marker 'left' without a parent"),
    ("", "[[joints]]\nkind = 'weld'\nparent = 'boom'\nchild = 'hub'\n", "cycle", "hub -> boom -> hub", "base frame"),
    ("", "[[joints]]\nkind = 'weld'\nparent = 'hub'\nchild = 'boom'\n", "child of a second joint"),
    ("", f"[bodies.box]\n{HIT}", "'hub', 'box' without a joint"),
    ("", "[[joints]]\nkind = 'free'\nchild = 'hub'\n", "attitude.rates", "already has"),
    ('kind = "weld"', 'kind = "revolute"\naxis = [0, 0, 0]', "joints[boom].axis", "needs a direction"),
    ('kind = "weld"', 'kind = "revolute"\naxis = "w"', "joints[boom].axis", "one of x, y, z"),
    ('kind = "weld"', 'kind = "revolute"\nstiffness = -1', "joints[boom].stiffness", "at least 0"),
    ('kind = "weld"', 'kind = "revolute"\nstiffness = "1 N/m"', "expected a rotational stiffness"),
    ('kind = "weld"', 'kind = "universal"\naxes = ["x", "x"]', "parallel", "use revolute"),
    ('kind = "weld"', 'kind = "general"\nslides = ["x"]\nposition = [1, 2]', "2 values in position and 1 slide"),
    ('kind = "weld"', 'kind = "general"\nslides = ["x", "x"]', "translation axes", "depend on each other"),
    # loads
    ('body = "hub"', 'body = "hob"', "loads[push].body", "did you mean 'hub'?"),
    ('body = "hub"', 'body = "hub"\nmarker = "rihgt"', "loads[push].marker", "'left', 'origin'"),
    ('body = "hub"', 'body = "hub"\nframe = "local"', "loads[push].frame", "'inertial'"),
    ('body = "hub"', 'body = "hub"\nframe = "orbital"', "loads[push].frame", "without an orbit"),
    ("times = [0, 2]", "times = [0, 1, 2]", "2 rows in torque and 3 times"),
    ("times = [0, 2]", "", "2 rows in torque without times"),
    ("times = [0, 2]", "times = [2, 0]", "time 0 s after 2 s"),
    (TORQUE, "torque = [[0, 0, 1]]\ntimes = [0]", "times [0.0]", "at least two"),
    ("[[0, 0, 1], [0, 0, 1]]", "[[0, 0, nan], [0, 0, 1]]", "loads[push].torque", "entry 3: found nan"),
    (TORQUE, "", "neither force nor torque"),
    ("[[0, 0, 1], [0, 0, 1]]", "[0, 0, 1]", "times with a constant torque"),
    ("", "[[loads]]\nname = 'push'\nbody = 'hub'\nforce = [1, 0, 0]\n", "'push' a second time"),
    (TORQUE, "table = 'push.csv'", "loads[push].table", "does not exist"),
    ("[[0, 0, 1], [0, 0, 1]]", "[[0, 0, 1], [0, 0, 1]]\ntable = 'push.csv'", "table and torque, times together"),
    ('name = "push"', 'name = "a/b"', "loads[a/b].name", "letters, digits"),
    # initial state
    ('marker = "tip", disp', 'marker = "top", disp', "bodies.boom.initial.marker", "did you mean 'tip'?"),
    ('"10 mm", 0]', '"10 mm", 0], amplitudes = [1]', "amplitudes and displacement together"),
    ('[0, "10 mm", 0]', '["10 mm", 0, 0]', "bodies.boom.initial", "[0.01, 0, 0] m", "give at most [0, 0, 0] m"),
    ('marker = "tip", displacement = [0, "10 mm", 0]', "amplitudes = [1, 2, 3, 4, 5]", "5 amplitudes", "has 4"),
    ('[0, "10 mm", 0]', '[0, "10 mm", 0], modes = [9]', "mode 9", "has 4"),
    ('marker = "tip", ', "", "displacement without marker"),
    ("mass = 200", "mass = 200\ninitial = {amplitudes = [1]}", "initial on a rigid body"),
    # expectations, study, pictures
    ("", "[expect.a]\nchannel = 'q'\nvalue = 1\n", "value without tolerance"),
    ("", "[expect.a]\nchannel = 'q'\nvalue = 1\ntolerance = 0\n", "tolerance of 0", "above 0"),
    ("", "[expect.a]\nchannel = 'q'\n", "no expected value"),
    ("", "[expect.a]\nof = 'peek'\nchannel = 'q'\nbelow = 1\n", "expect.a.of", "did you mean 'peak'?"),
    ("", "[expect.a]\nof = 'mode_frequency'\nbody = 'bom'\nbelow = 1\n", "expect.a.body", "did you mean 'boom'?"),
    ("", "[expect.a]\nbelow = 1\n", "without channel"),
    ("", "[expect.a]\nchannel = 'q'\nvalue = '1 m'\ntolerance = '1 deg'\n", "value in m, tolerance in rad"),
    ("", "[expect.a]\nchannel = 'q'\nat = 20\nbelow = 1\n", "expect.a.at", "0 to 10 s"),
    ("", "[expect.a]\nchannel = 'attitude/angle'\nbelow = 1\n", "did you mean 'attitude/angles'?"),
    (
        "",
        "[expect.a]\nchannel = 'attitude/angles'\ncomponent = 'pitch'\nbelow = 1\n",
        "component",
        "known are 'x', 'y', 'z'",
    ),
    ("", "[expect.a]\nchannel = 'attitude/angles'\ncomponent = 3\nbelow = 1\n", "3 entries"),
    ("", "[expect.a]\nchannel = 'q'\nabove = 2\nbelow = 1\n", "between which nothing lies"),
    ("", "[pictures]\ntimes = [20]\n", "pictures.times", "0 to 10 s"),
    ("", "[pictures]\nmodes = ['bom']\n", "pictures.modes[0]", "did you mean 'boom'?"),
    ("", "[pictures]\nplots = ['attitude/anglez']\n", "pictures.plots[0]", "did you mean 'attitude/angles'?"),
    ("", "[pictures]\nscale = 'big'\n", "pictures.scale", "'auto'"),
    ("", "[study]\nmodes = [1, 2, 3]\n", "study.quantity", "missing"),
]
SIGHT = "[[sights]]\nname = 'look'\nbody = 'boom'\nmarker = 'tip'\n"
IN_THE_TEXT += [
    ("", SIGHT, "sights[look]: found a line of sight", "give an [orbit]"),
    ("", ORBIT + SIGHT.replace("'boom'", "'bom'"), "sights[look].body: found 'bom'", "did you mean 'boom'?"),
    ("", ORBIT + SIGHT.replace("'tip'", "'tp'"), "sights[look].marker: found 'tp'", "did you mean 'tip'?"),
    ("", ORBIT + SIGHT + SIGHT, "sights[1: look]: found the name 'look' a second time; sights[0: look] has it"),
    ("", ORBIT + SIGHT + "axis = [0, 0, 0]\n", "sights[look].axis: found [0, 0, 0]", "not all zero"),
    ("", ORBIT + SIGHT + "radius = -1\n", "sights[look].radius", "-1"),
    ("", ORBIT + SIGHT + "latitude = '1 m'\n", "sights[look].latitude", "expected an angle"),
    ("", ORBIT + SIGHT + "latitde = 1\n", "sights[look].latitde", "did you mean 'latitude'?"),
]
MISTAKES = IN_THE_TEXT


@pytest.mark.parametrize("row", MISTAKES, ids=[f"{k}: {row[2]}" for k, row in enumerate(MISTAKES)])
def test_a_mistake_in_the_case_is_answered(row: tuple[str, ...], craft: str, write_case: Callable[..., Path]):
    old, new, *fragments = row
    assert old in craft
    text = craft.replace(old, new) if old else craft + new
    with pytest.raises(CaseError) as caught:
        build_system(read_case(write_case(text)))
    message = str(caught.value)
    assert message.startswith("craft.toml: ")
    for fragment in fragments:
        assert fragment in message


def test_the_case_without_mistakes_is_sound(write_case: Callable[..., Path]):
    system = build_system(read_case(write_case()))
    assert system.root == "hub" and system.bodies["boom"].n_modes == 4


def test_all_problems_of_a_file_are_reported_together(craft: str, write_case: Callable[..., Path]):
    text = (
        craft.replace("mass = 200", "mass = -200")
        .replace('group = "TIP"', 'group = "END"')
        .replace('body = "hub"', 'body = "hob"')
    )
    with pytest.raises(CaseError) as caught:
        read_case(write_case(text + "[expect.a]\nchannel = 'q'\n"))
    where = [problem.where for problem in caught.value.problems]
    assert where == ["bodies.hub.mass", "expect.a", "loads[push].body", "bodies.boom.markers.tip.group"]
    assert str(caught.value).count("\n") == 3


def test_a_misspelt_key_is_not_also_called_missing(craft: str, write_case: Callable[..., Path]):
    with pytest.raises(CaseError) as caught:
        read_case(write_case(craft.replace("mass = 200", "mas = 200")))
    assert [p.text for p in caught.value.problems] == ["this key is not known; did you mean 'mass'?"]


def test_a_case_file_that_cannot_be_read_is_reported(tmp_path: Path, write_case: Callable[..., Path]):
    write_case()
    with pytest.raises(CaseError, match=r"no such case file; did you mean 'craft.toml'\?"):
        read_case(tmp_path / "kraft.toml")
    with pytest.raises(CaseError, match=r"run.h5: there is no such file; give the name of one that is there$"):
        read_case(tmp_path / "run.h5")
    for k in range(12):
        write_case(name=f"other{k}.toml")
    with pytest.raises(CaseError, match=r"no such case file; 13 others are there, such as 'craft.toml'$"):
        read_case(tmp_path / "zzz.toml")
    with pytest.raises(CaseError, match=r"no such case file; did you mean 'craft.toml'\?"):  # however many there are
        read_case(tmp_path / "kraft.toml")
    with pytest.raises(CaseError, match="found a folder"):
        read_case(tmp_path)
    (tmp_path / "run.toml").write_bytes(b"\x89HDF\r\n\x1a\n\xff\xff")
    with pytest.raises(CaseError, match="not text"):
        read_case(tmp_path / "run.toml")
    (tmp_path / "empty.toml").write_text("")
    with pytest.raises(CaseError, match="run: this key is missing"):
        read_case(tmp_path / "empty.toml")


def test_an_orbiting_root_may_not_slide(craft: str, write_case: Callable[..., Path]):
    free = "[[joints]]\nkind = 'free'\nchild = 'hub'\n"
    text = craft.replace(f"{RATE}\n", "") + ORBIT
    with pytest.raises(CaseError, match=r"joints\[hub\].kind: found 'free' for the root body; on a specified orbit"):
        read_case(write_case(text + free))
    with pytest.raises(CaseError, match=r"found 'spherical' for the root body; on a free orbit"):
        read_case(write_case(text + "kind = 'free'\n" + free.replace("'free'", "'spherical'")))


@pytest.mark.parametrize(
    ("table", "fragments"),
    [
        ("time,tz\n0,1\n", ("1 row", "at least two")),
        ("time,tz\n0,1\n1\n", ("line 3", "1 entry", "2 columns")),
        ("time,tz\n0,1\n1,x\n", ("line 3", "'x' for tz")),
        ("time,tz\n0,1\n1,nan\n", ("line 3", "nan for tz", "finite")),
        ("time,tz\n0,1\n1,1e300\n", ("line 3", "1e300 for tz", "between 1e-30 and 1e+30")),
        ("time,tz\n0,1\n1,\udcff\n", ("push.csv is no CSV file in UTF-8",)),
        ("time,tz\n0," + 200_000 * "9" + "\n", ("push.csv is no CSV file", "field larger than field limit")),
        ("time,tz\n1,1\n0,1\n", ("line 3", "time 0 s after 1 s")),
        ("time,torque\n0,1\n1,1\n", ("column 'torque'", "known are")),
        ("time,tz [N]\n0,1\n1,1\n", ("column 'tz'", "a force", "expected a torque")),
        ("tz\n0\n1\n", ("it needs time",)),
        ("time,tz,tz\n0,1,1\n", ("'tz' stands twice",)),
        ("", ("empty", "names the columns")),
    ],
)
def test_a_mistake_in_a_load_table_is_answered(
    table: str, fragments: tuple[str, ...], craft: str, write_case: Callable[..., Path]
):
    path = write_case(craft.replace(TORQUE, "table = 'push.csv'"))
    path.with_name("push.csv").write_text(table, encoding="utf-8", errors="surrogateescape")
    with pytest.raises(CaseError) as caught:
        build_system(read_case(path))
    assert str(caught.value).startswith("craft.toml: loads[push]: ")
    assert all(fragment in str(caught.value) for fragment in ("push.csv", *fragments))
