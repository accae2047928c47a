"""Tables are refused just beyond their limits, with what was found, and accepted just within."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from femflex.case.body import AnalyticTable, BushingTable, FlexibleTable, RigidTable
from femflex.case.campbell import CampbellTable
from femflex.case.connection import DistributingInterfaceTable, RegionTable, RigidInterfaceTable
from femflex.case.constraint import SpringTable
from femflex.case.controller import PulsesTable
from femflex.case.deploying import DeployingTable, TaperTable
from femflex.case.initial import InitialTable, StartTable
from femflex.case.joint import Joint
from femflex.case.joint_base import ReleaseTable
from femflex.case.load import LoadTable
from femflex.case.matrices import MatricesTable
from femflex.case.measure import ExpectTable, MeasureTable
from femflex.case.orbit import AttitudeTable, OrbitTable
from femflex.case.preload import PreloadTable
from femflex.case.reduction import DampingTable, Reduction
from femflex.case.run import PicturesTable, RunTable, StudyTable
from femflex.case.section import Isotropic, Stiffness, Tube
from femflex.case.sensor import SensorTable
from femflex.case.sight import SightTable
from femflex.case.stability import AxisTable, StabilityTable
from femflex.case.sweep import SweepTable
from femflex.case.thruster import ThrusterTable
from femflex.case.wheel import SignalTable, WheelTable

BEAM = {"kind": "deploying", "family": "beam", "length": 5.0, "mass_per_length": 0.4, "EIy": 3.0, "EIz": 2.0}
REELED = {"kind": "deploying", "family": "tether", "mass_per_length": 0.4}
PLATE = {
    "kind": "deploying",
    "family": "plate",
    "length": 5.0,
    "mass_per_length": 1,
    "width": 2,
    "bending_stiffness": 3,
}
BLANKET = {"kind": "deploying", "family": "membrane", "length": 5.0, "mass_per_length": 1, "width": 2, "tension": 3}
MESHED = {
    "kind": "flexible",
    "mesh": "a.msh",
    "members": [{"group": "line", "family": "beam"}],
    "reduction": {"method": "cantilever", "clamp": "root", "modes": 3},
}
CUT = MESHED | {"members": [{"group": "line", "family": "beam", "segments": 3}]}
BONDED = MESHED | {"reduction": {"method": "craig_bampton", "modes": 2}}
DECK = {"kind": "flexible", "deck": "a.bdf", "reduction": MESHED["reduction"]}
MATRICES = {"kind": "matrices", "matrices": {"mass": "m.mtx", "stiffness": "k.mtx"}}
EXPECT = {"channel": "q", "value": 2.0}
SWEEP = {"case": "a.toml", "outputs": {"peak": {"of": "peak", "channel": "q"}}}
HALF = {"values": [1, 2]}


def with_functions(table: dict[str, Any], **functions: Any) -> dict[str, Any]:
    return table | {"functions": functions}


def spherical(**more: Any) -> dict[str, Any]:
    return {"kind": "spherical", "child": "a", "motion": {"angles": ["free", 0.2, "free"]}} | more


# type, table, fragments of the sentence
REFUSED: list[tuple[Any, dict[str, Any], str]] = [
    (TaperTable, {"along": [1.0], "mass": [2.0]}, r"found along = \[1.0\]; give at least two distances, ascending"),
    (TaperTable, {"along": [1.0, 3.0, 3.0], "mass": [2, 2, 1]}, r"found along = \[1.0, 3.0, 3.0\]"),
    (TaperTable, {"along": [1.0, 3.0]}, "without factors"),
    (TaperTable, {"along": [1.0, 3.0], "torsion": [1, 2, 4]}, "found 3 factors in torsion at 2 points"),
    (TaperTable, {"along": [1, 3, 4], "mass": [1, 2, 3], "axial": [1, 2]}, "found 2 factors in axial at 3 points"),
    (DeployingTable, BEAM | {"length": "locked"}, "found length = 'locked'"),
    (DeployingTable, REELED, "found neither length nor reel, or both"),
    (
        DeployingTable,
        REELED | {"length": 3, "reel": {"length": 2}, "stock": 9},
        "found neither length nor reel, or both",
    ),
    (DeployingTable, REELED | {"reel": {"length": 2}}, "found a reel without stock"),
    (DeployingTable, REELED | {"reel": {"length": 2.1}, "stock": 2.0}, "stock below the initial length"),
    (DeployingTable, {**BEAM, "mass_per_length": None, "mass": 3}, "found mass without stock"),
    (DeployingTable, PLATE | {"width": None}, "found a plate without width"),
    (DeployingTable, BLANKET | {"width": None}, "found a membrane without width"),
    (DeployingTable, PLATE | {"bending_stiffness": 0}, "found a plate without bending_stiffness"),
    (DeployingTable, BLANKET | {"tension": 0}, "found a membrane without tension"),
    (DeployingTable, with_functions(BEAM | {"EIy": 0, "EIz": 0}, y=1), "found a beam without bending stiffness"),
    (DeployingTable, with_functions(BEAM, y=2, elements=9), "functions.elements without family"),
    (
        DeployingTable,
        with_functions(BEAM, y=2, family="elements", static=True),
        "found functions.static, tip or straight",
    ),
    (DeployingTable, with_functions(BEAM, y=2, family="elements", tip=True), "found functions.static, tip or straight"),
    (
        DeployingTable,
        with_functions(BLANKET, z=2, family="elements", straight=False),
        "found functions.static, tip or straight",
    ),
    (
        DeployingTable,
        with_functions(BEAM, y=2, family="polynomial", joints=["tip"]),
        "found functions.joints with family = 'polynomial'",
    ),
    (
        DeployingTable,
        with_functions(BEAM, y=2, family="polynomial", loads=True),
        "found functions.loads with family = 'polynomial'",
    ),
    (
        DeployingTable,
        with_functions(BEAM, y=2, family="elements", joints=["root"]),
        "found functions.joints with family = 'elements'",
    ),
    (DeployingTable, PLATE | {"taper": {"along": [1, 2], "mass": [1, 2]}}, "found taper with a plate"),
    (
        DeployingTable,
        REELED | {"reel": {"length": 2}, "stock": 3, "taper": {"along": [1, 2], "mass": [1, 2]}},
        "found taper with a free length",
    ),
    (DeployingTable, with_functions(BEAM, y=1, axial=2), "found axial functions without EA"),
    (DeployingTable, with_functions(BEAM, y=1, torsion=2), "found torsion functions without GJ"),
    (DeployingTable, BEAM | {"markers": {"mid": {}}}, "found marker 'mid' of a deploying member without fraction"),
    (DeployingTable, BEAM | {"markers": {"mid": {"position": [1, 0, 0]}}}, "found position or group in marker 'mid'"),
    (
        DeployingTable,
        BEAM | {"markers": {"mid": {"group": "g", "fraction": 0.5}}},
        "found position or group in marker 'mid'",
    ),
    (DeployingTable, BEAM | {"markers": {"mid": {"fraction": 1.01}}}, "found fraction 1.01 of marker 'mid'"),
    (DeployingTable, BEAM | {"markers": {"mid": {"fraction": -0.01}}}, "found fraction -0.01 of marker 'mid'"),
    *(
        (
            DeployingTable,
            with_functions(table, **{key: value}),
            rf"found functions.{key}, which a {table['family']} does not use",
        )
        for table, unused in (
            (BEAM, {"across": 2, "straight": False}),
            (
                REELED | {"length": 4},
                {"torsion": 1, "across": 2, "static": True, "tip": True, "joints": ["tip"], "loads": True},
            ),
            (
                PLATE,
                {
                    "y": 1,
                    "axial": 1,
                    "torsion": 2,
                    "static": True,
                    "tip": True,
                    "joints": [],
                    "loads": False,
                    "straight": False,
                },
            ),
            (
                BLANKET,
                {"y": 1, "axial": 1, "torsion": 2, "static": True, "tip": True, "joints": ["root"], "loads": True},
            ),
        )
        for key, value in unused.items()
    ),
    # bodies
    (
        RigidTable,
        {"kind": "rigid", "mass": 1, "inertia": [1, 1, 1], "recovery": {"a": {"position": [0, 0, 0]}}},
        "found recovery on a rigid body",
    ),
    (
        RigidTable,
        {"kind": "rigid", "mass": 1, "inertia": [1, 1, 1], "markers": {"m": {"group": "g"}}},
        "found group in marker 'm' of a rigid body",
    ),
    (
        RigidTable,
        {"kind": "rigid", "mass": 1, "inertia": [1, 1.2, 2.201]},
        "triangle inequality, with principal moments 1, 1.2, 2.201 kg m",
    ),
    (
        RigidTable,
        {"kind": "rigid", "mass": 1, "inertia": [[2, 0.1, 0], [0.1, 3, 0.2], [0, 0.3, 4]]},
        r"entry \(2, 3\) is 0.2, \(3, 2\) is 0.3",
    ),
    (
        RigidTable,
        {"kind": "rigid", "mass": 1, "inertia": [[1, 1.5, 0], [1.5, 1, 0], [0, 0, 2]]},
        r"principal moments -0.5, 2, 2.5 kg m\^2",
    ),
    (
        BushingTable,
        {"group": "a", "to": "b", "stiffness": 3, "rotation": [1, 0, 0]},
        "found stiffness together with rotation",
    ),
    (BushingTable, {"group": "a", "stiffness": 3}, "found `stiffness` without `to`"),
    (BushingTable, {"group": "a", "translation": [0, 0, 0]}, "found no stiffness"),
    (FlexibleTable, MESHED | {"deck": "b.bdf"}, "found mesh and deck"),
    (FlexibleTable, MESHED | {"units": "mm-t-s"}, "found units without a deck"),
    (FlexibleTable, MESHED | {"overrides": {"pid_1": {"E": 2e9}}}, "found overrides without a deck"),
    (FlexibleTable, DECK | {"mesh_unit": "mm"}, "found mesh_unit or groups with a deck"),
    (FlexibleTable, DECK | {"groups": {"a": "PID 1"}}, "found mesh_unit or groups with a deck"),
    (FlexibleTable, DECK | {"members": CUT["members"]}, "found segments in a member of a deck"),
    (FlexibleTable, MESHED | {"members": []}, "found no members"),
    (FlexibleTable, CUT | {"preload": {"acceleration": [1, 0, 0]}}, "found preload on a body cut into segments"),
    (
        FlexibleTable,
        MESHED | {"reduction": {"method": "lumped", "clamp": "root"}, "preload": {"acceleration": [1, 0, 0]}},
        "found preload on a lumped body",
    ),
    (FlexibleTable, BONDED, "found craig_bampton without interfaces"),
    (FlexibleTable, MESHED | {"reduction": None}, "found no reduction"),
    (FlexibleTable, CUT | {"reduction": {"method": "rigid"}}, "found reduction method 'rigid' and segments"),
    (
        FlexibleTable,
        CUT | {"reduction": {"method": "lumped", "clamp": "r"}},
        "found reduction method 'lumped' and segments",
    ),
    (
        FlexibleTable,
        CUT | {"bushings": [{"group": "a", "translation": [1, 0, 0]}]},
        "found bushings on a body cut into segments",
    ),
    (FlexibleTable, CUT | {"damping": {"ratio": 0.01}}, "found damping by ratio or mass on a body cut into segments"),
    (
        FlexibleTable,
        CUT | {"damping": {"mass": 0.01, "stiffness": 0.1}},
        "found damping by ratio or mass on a body cut",
    ),
    (FlexibleTable, CUT | {"initial": {"amplitudes": [1]}}, "found initial on a body cut into segments"),
    (
        FlexibleTable,
        MESHED | {"strain": "linear", "reduction": MESHED["reduction"] | {"derivatives": 3, "third_derivatives": 1}},
        "found third_derivatives in the reduction of a body with linear strain",
    ),
    (
        FlexibleTable,
        CUT | {"reduction": MESHED["reduction"] | {"derivatives": 3, "third_derivatives": 1}},
        "found third_derivatives in the reduction of a body cut into segments",
    ),
    (
        FlexibleTable,
        MESHED | {"strain": "condensed", "reduction": MESHED["reduction"] | {"responses": 2, "deflection": 0.1}},
        "found responses in the reduction of a body with strain = 'condensed'",
    ),
    (
        FlexibleTable,
        CUT | {"members": [*CUT["members"], {"group": "edge", "family": "beam", "segments": 2}]},
        "members on line, edge",
    ),
    (
        FlexibleTable,
        CUT | {"members": [{"group": "line", "family": "tether", "segments": 3}]},
        "found segments in a member of the family tether",
    ),
    (
        AnalyticTable,
        {"kind": "analytic", "length": 1, "EA": 1, "EIy": 1, "EIz": 1, "GJ": 1, "functions": {"y": 1}},
        "found none of mass, mass_per_length",
    ),
    (MatricesTable, MATRICES | {"matrices": {"mass": "m.mtx"}}, "found neither file nor both of mass and stiffness"),
    (
        MatricesTable,
        MATRICES | {"matrices": {"stiffness": "m.mtx"}},
        "found neither file nor both of mass and stiffness",
    ),
    (
        MatricesTable,
        MATRICES | {"reduction": MESHED["reduction"] | {"spin": True, "derivatives": 3}},
        "found derivatives, spin in the reduction of a body from matrices",
    ),
    (MatricesTable, MATRICES | {"reduction": {"method": "lumped", "clamp": "a"}}, "found method 'lumped'"),
    (RigidInterfaceTable, {"kind": "rigid", "group": "a"}, "found none of reference, position"),
    (DistributingInterfaceTable, {"kind": "distributing", "group": "a"}, "found none of reference, position"),
    (RegionTable, {"box": [[0, 0, 0], [1, 1, 1]], "points": [3]}, "found box and points together"),
    (SpringTable, {"name": "s", "body": "a", "parent_marker": "m"}, "found parent_marker 'm' without a parent"),
    # reductions and damping
    (DampingTable, {"ratio": 0.1, "stiffness": 0.0}, "found ratio together with mass or stiffness"),
    (DampingTable, {}, "found no damping"),
    (Reduction, MESHED["reduction"] | {"responses": 2}, "found responses = 2 without deflection"),
    (Reduction, MESHED["reduction"] | {"deflection": 0.25}, "found deflection = 0.25 m without derivatives"),
    (
        Reduction,
        MESHED["reduction"] | {"deflection": 0.25, "derivatives": 0},
        "found deflection = 0.25 m without derivatives",
    ),
    (
        Reduction,
        {"method": "free_free", "modes": 3, "deflection": 0.25, "derivatives": 2},
        "found deflection = 0.25 m in a reduction without a clamp",
    ),
    (Reduction, MESHED["reduction"] | {"clamp": []}, "found no group to clamp"),
    (Reduction, MESHED["reduction"] | {"derivatives": -1}, "found -1"),
    (Reduction, MESHED["reduction"] | {"derivatives": True}, "found true"),
    # initial states and motion
    (InitialTable, {"amplitudes": [1], "modes": [2]}, "found modes, which go with a displacement"),
    (
        InitialTable,
        {"marker": "tip", "displacement": [1, 0, 0], "shape": "static", "modes": [2]},
        "found modes, which go with",
    ),
    (InitialTable, {"marker": "tip", "displacement": [1, 0, 0], "length": 3}, "found `length` without `relative`"),
    (InitialTable, {"marker": "tip", "rates": [1]}, "a marker without displacement"),
    (InitialTable, {"relative": [1, 0, 0]}, "found a displacement without marker"),
    (StartTable, {"from": "a.h5", "keep": ["hinge"]}, "found `keep` together with from = 'a.h5'"),
    (
        Joint,
        spherical(sequence="extrinsic xyz"),
        "found sequence 'extrinsic xyz' and rebase = false with motion.angles",
    ),
    (Joint, spherical(rebase=True), "found sequence 'xyz' and rebase = true with motion.angles"),
    (Joint, spherical(rates=[0, 0, 1]), "found rates with motion.angles"),
    (Joint, spherical(stiffness=[2, 0, 0]), "found stiffness with motion.angles"),
    (Joint, spherical(damping=[0, 0, 2]), "found damping with motion.angles"),
    (Joint, spherical(rotation="zxz"), "found rotation 'zxz' and motion.angles"),
    (
        Joint,
        {"kind": "general", "child": "a", "slides": ["x", "y"], "slide_rest": [1]},
        "found 1 value in slide_rest and 2 slides",
    ),
    (Joint, {"kind": "general", "child": "a", "turns": ["x"], "rates": [1, 2]}, "found 2 values in rates and 1 turn"),
    (
        Joint,
        {"kind": "general", "child": "a", "turns": ["x", "y"], "motion": {"angles": ["free"]}},
        "found 1 motion in motion.angles and 2 turns",
    ),
    (
        Joint,
        {"kind": "prismatic", "child": "a", "motion": {"position": 2}, "velocity": 1},
        "found velocity for a coordinate that is prescribed by motion.position; the motion sets",
    ),
    (
        Joint,
        {"kind": "prismatic", "child": "a", "motion": {"position": 2}, "damping": 1},
        "found damping for a coordinate that is prescribed by motion.position; it has no effect",
    ),
    (
        Joint,
        {"kind": "revolute", "child": "a", "motion": {"angle": "locked"}, "rate": 1},
        "found rate for a coordinate that is locked by motion.angle",
    ),
    (
        Joint,
        {"kind": "universal", "child": "a", "motion": {"angles": ["free", 1]}, "angles": [0, 1]},
        "found angles for a coordinate that is prescribed by motion.angles",
    ),
    (
        Joint,
        {"kind": "universal", "child": "a", "axes": [[1, 2, 3], [-2, -4, -6]]},
        r"found axes \[1.0, 2.0, 3.0\] and \[-2.0, -4.0, -6.0\], which are parallel",
    ),
    (Joint, {"kind": "weld", "child": "a", "parent_marker": "m"}, "found parent_marker 'm' without a parent"),
    (ReleaseTable, {"signal": "a.b", "above": 1, "below": 0}, "found above and below together"),
    # loads, run, pictures
    (
        LoadTable,
        {"name": "l", "body": "a", "force": [[1, 0, 0]], "times": [1]},
        r"found times \[1.0\]; a table needs at least two",
    ),
    (
        LoadTable,
        {"name": "l", "body": "a", "force": [[1, 0, 0], [2, 0, 0]], "times": [3, 1]},
        "found time 1 s after 3 s",
    ),
    (LoadTable, {"name": "l", "body": "a", "torque": [[1, 0, 0], [2, 0, 0]]}, "found 2 rows in torque without times"),
    (
        LoadTable,
        {"name": "l", "body": "a", "torque": [1, 0, 0], "times": [1, 2, 4]},
        "found times with a constant torque; give one row of torque per time, 3",
    ),
    (
        LoadTable,
        {"name": "l", "body": "a", "torque": [[1, 0, 0], [2, 0, 0]], "times": [1, 2, 3]},
        "found 2 rows in torque and 3 times",
    ),
    (LoadTable, {"name": "l", "body": "a", "table": "a.csv", "times": [1, 2]}, "found table and times together"),
    (RunTable, {"duration": 4, "output_step": 4.1}, "found an output step of 4.1 s, longer than the duration of 4 s"),
    (RunTable, {"duration": 4, "output_step": 1, "samples": 3}, "found output_step and samples together"),
    (RunTable, {"duration": 4, "rtol": 0.11}, "it must be at most 0.1"),
    (PicturesTable, {"without": ["a"], "linearised": True}, "found without and linearised"),
    (
        StudyTable,
        {"quantity": {"of": "campbell_frequency", "branch": "a", "speed": 1}},
        "found quantity of = 'campbell_frequency'",
    ),
    # measures and expectations
    (MeasureTable, {"of": "mode_frequency"}, "found of = 'mode_frequency' without body"),
    (MeasureTable, {"of": "body_mass", "body": "a", "channel": "q"}, "found of = 'body_mass' with a channel"),
    (MeasureTable, {"of": "peak", "channel": "q", "at": 3}, "found `at` together with of = 'peak'"),
    (MeasureTable, {"of": "frequency", "channel": "q", "tone": 3, "tones": 2}, "found tone = 3 and tones = 2"),
    (MeasureTable, {"of": "peak", "channel": "q", "relative": True}, "found `relative` together with of = 'peak'"),
    (MeasureTable, {"of": "peak", "channel": "q", "branch": "a"}, "found of = 'peak'; branch and speed go with"),
    (MeasureTable, {"of": "campbell_frequency", "branch": "a"}, "which needs both"),
    (MeasureTable, {"of": "system_frequency", "body": "a"}, "found of = 'system_frequency' with a channel or a body"),
    (
        ExpectTable,
        EXPECT | {"value": 0, "relative_tolerance": 0.1},
        "found relative_tolerance for an expected value of 0",
    ),
    (
        ExpectTable,
        EXPECT | {"tolerance": 1, "relative_tolerance": 0.1},
        "found tolerance and relative_tolerance together",
    ),
    (ExpectTable, EXPECT | {"tolerance": 0}, "found a tolerance of 0; it must be above 0"),
    (ExpectTable, EXPECT, "found value without tolerance"),
    (
        ExpectTable,
        {"channel": "q", "above": 2, "below": 2},
        "found above = 2 and below = 2, between which nothing lies",
    ),
    (ExpectTable, {"channel": "q", "above": "2 m", "below": "3 s"}, "above in m, below in s"),
    (ExpectTable, {"channel": "q", "value": True, "tolerance": 1}, r"found true \(a truth value\)"),
    # orbit and attitude
    (
        OrbitTable,
        {"semi_major_axis": 7e6, "eccentricity": 0.2},
        r"found a perigee 778.1 km below the surface \(radius 6378137 m\)",
    ),
    (
        OrbitTable,
        {"perigee_altitude": "-1 km", "radius": 3e6},
        r"found a perigee 1 km below the surface \(radius 3000000 m\)",
    ),
    (AttitudeTable, {"nominal_axes": ["x", "y", "z"], "marker": "m"}, "found nominal_axes and marker together"),
    (AttitudeTable, {"nominal_axes": ["x", "y", "x"]}, r"found nominal_axes \['x', 'y', 'x'\]"),
    (AttitudeTable, {"pitch": 0.1, "roll": 0.1, "angles": [0, 0, 0]}, "found angles and pitch, roll together"),
    (AttitudeTable, {"yaw": 0.1, "sequence": "extrinsic zxz"}, "found yaw with sequence 'extrinsic zxz'"),
    (AttitudeTable, {"frame": "spinning"}, "found spin without frame"),
    (
        AttitudeTable,
        {"held": True, "rates": [0, 0, 0], "velocity": [0, 1, 0]},
        "found held = true together with velocity",
    ),
    (AttitudeTable, {"held": True, "rebase": True}, "found held = true together with rebase"),
    (
        PreloadTable,
        {"spin": [0, 0, 1], "orbit": {"vertical": [0, 0, 1], "normal": [1, 0, 0]}},
        "found spin and orbit together",
    ),
    (PreloadTable, {"acceleration": [0, 0, 0], "masses": {"a": 3}}, "found no load"),
    # actuators, sensors, controllers
    (
        PulsesTable,
        {"kind": "pulses", "inputs": ["a"], "outputs": ["b"], "full": 1, "period": 2, "minimum_on": 2},
        "found minimum_on 2 s, and a period of 2 s",
    ),
    (SensorTable, {"kind": "rate"}, "found no body for a sensor of kind 'rate'"),
    (SensorTable, {"kind": "acceleration", "body": "a"}, "found no bandwidth for a sensor of kind 'acceleration'"),
    (SensorTable, {"kind": "attitude", "body": "a", "slew_axis": [0, 0, 1]}, "found one of slew_axis and slew_angle"),
    (SensorTable, {"kind": "attitude", "body": "a", "slew_angle": "b.c"}, "found one of slew_axis and slew_angle"),
    (SensorTable, {"kind": "rate", "body": "a", "quantum": 1}, "found quantum without period"),
    (SensorTable, {"kind": "strain", "body": "a", "component": "axial"}, "found a strain without period"),
    (
        SensorTable,
        {"kind": "strain", "body": "a", "component": "axial", "period": 1, "bias": [1, 2]},
        "found 2 numbers in bias; a sensor of kind 'strain' has 1 output",
    ),
    (
        SensorTable,
        {"kind": "joint", "coordinate": "a", "bias": [1]},
        "found 1 number in bias; a sensor of kind 'joint' has 2 outputs",
    ),
    (SensorTable, {"kind": "pointing", "body": "a", "bias": [1, 2]}, "a sensor of kind 'pointing' has 1 output"),
    (SensorTable, {"kind": "rate", "body": "a", "bias": [1, 2]}, "a sensor of kind 'rate' has 3 outputs"),
    *(
        (
            SensorTable,
            {"kind": kind, "body": "a", "bandwidth": 1, "coordinate": "c", "signal": "s", key: value},
            f"found .* for a sensor of kind '{kind}'",
        )
        for kind, key, value in (
            ("rate", "axis", [0, 0, 1]),
            ("velocity", "offset", [0, 0, 1]),
            ("rate", "other_body", "b"),
        )
    ),
    (SignalTable, {"times": [0, 1, 2], "values": [1, 2]}, "found 3 times and 2 values"),
    (SignalTable, {"times": [0, 2, 2], "values": [1, 2, 3]}, r"found times \[0.0, 2.0, 2.0\]; they must rise"),
    (
        WheelTable,
        {"body": "a", "inertia": 1, "inertia_in_body": "contained", "max_speed": 3, "initial_speed": -3.5},
        "found initial_speed -3.5 rad/s beyond max_speed 3 rad/s",
    ),
    (
        WheelTable,
        {"body": "a", "inertia": 1, "inertia_in_body": "added", "mass": 2},
        "without mass and transverse_inertia",
    ),
    (
        WheelTable,
        {"body": "a", "inertia": 1, "inertia_in_body": "contained", "transverse_inertia": 2},
        "found transverse_inertia with inertia_in_body",
    ),
    (
        WheelTable,
        {"body": "a", "inertia": 1, "inertia_in_body": "contained", "speed": 1, "command": "c.x"},
        "found speed and command together",
    ),
    (
        ThrusterTable,
        {"body": "a", "thrust": 1, "pulses": [[0, 1]], "command": "c.x"},
        "found pulses and command; give one of",
    ),
    (
        ThrusterTable,
        {"body": "a", "thrust": 1, "pulses": [[0, 1]], "tank": "t"},
        "found tank 't' without specific_impulse",
    ),
    (ThrusterTable, {"body": "a", "thrust": 1, "pulses": [[0, 1]], "switched": True}, "found switched without command"),
    (SightTable, {"name": "s", "body": "a", "axis": [0, 0, 0]}, r"found \[0, 0, 0\], which has no direction"),
    # diagrams and sweeps
    (CampbellTable, {"speeds": [0.0, 1.0], "axis": [0, 0, 0]}, "found an axis of no length"),
    (CampbellTable, {"speeds": 3.0}, "expected speeds such as"),
    (CampbellTable, {"speeds": [1.0]}, "found 1 speed"),
    (CampbellTable, {"speeds": "0:60 rpm:1"}, "found '1' speeds in '0:60 rpm:1'; give a whole number from 2 to 10000"),
    (CampbellTable, {"speeds": "0:60 rpm:10001"}, "give a whole number from 2 to 10000"),
    (CampbellTable, {"speeds": "-60 rpm,30 rpm"}, "found speeds from -60 rpm"),
    (CampbellTable, {"speeds": "0,60,60 rpm"}, "found speeds that do not rise: 0, 60, 60 rpm"),
    (AxisTable, {"between": ["1 m", "2 kg"]}, r"found \['1 m', '2 kg'\], in two units"),
    (AxisTable, {"between": ["much", 2]}, "does not begin with a number"),
    (AxisTable, {"between": [2, 2]}, "the second must be above the first"),
    (AxisTable, {"between": [1, 2], "points": 2002}, "found 2002 points; give at most 2001"),
    (StabilityTable, {"vary": {"k_roll": {"between": [0, 1]}}}, "found 'k_roll' without inertia"),
    (
        StabilityTable,
        {"vary": {"k_roll": {"between": [0, 1]}, "a": {"between": [0, 1]}}, "inertia": "hub"},
        "found inertia with vary of k_roll, a",
    ),
    (
        StabilityTable,
        {"vary": {"a": {"between": [0, 1]}}, "shooting": True},
        "found period or shooting with of = 'equilibrium'",
    ),
    (
        StabilityTable,
        {"vary": {"a": {"between": [0, 1]}}, "period": 2},
        "found period or shooting with of = 'equilibrium'",
    ),
    (
        SweepTable,
        SWEEP | {"vary": {"a": {"normal": [1, 0]}}, "design": "random", "members": 3},
        "the standard deviation must be above 0",
    ),
    (
        SweepTable,
        SWEEP | {"vary": {"a": {"between": ["1 m", "2 s"]}}, "design": "random", "members": 3},
        "in two units",
    ),
    (
        SweepTable,
        SWEEP | {"vary": {"a": {"between": ["x", 2]}}, "design": "random", "members": 3},
        "does not begin with a number",
    ),
    (
        SweepTable,
        SWEEP | {"vary": {"a": HALF, "b": {"values": [1, 2, 3]}}, "design": "list"},
        "found lists of different lengths: {'a': 2, 'b': 3}",
    ),
    (SweepTable, {"case": "a.toml", "vary": {"a": HALF}}, "found neither outputs nor histories"),
    (
        SweepTable,
        SWEEP | {"vary": {"a": HALF}, "outputs": {"f": {"of": "campbell_frequency", "branch": "a", "speed": 1}}},
        "found of = 'campbell_frequency' for 'f'",
    ),
    (
        SweepTable,
        SWEEP | {"vary": {"a": HALF}, "percentiles": [5, 100.1]},
        "entry 2: found 100.1; it must be at most 100",
    ),
    (SweepTable, SWEEP | {"vary": {"a": HALF}, "members": 3}, "found design = 'grid' with members"),
    (
        SweepTable,
        SWEEP | {"vary": {"a": HALF}, "design": "sobol", "members": 3},
        "found design = 'sobol', which needs between or normal for 'a'",
    ),
    (
        SweepTable,
        SWEEP | {"vary": {"a": {"between": [1, 2]}}, "design": "list"},
        "found design = 'list', which needs values for 'a'",
    ),
    *(
        (
            SweepTable,
            SWEEP | {"vary": {"a": {"between": [1, 2]}}, "design": "sobol_indices", "members": n},
            f"found members = {n}; design = 'sobol_indices' needs a power of 2",
        )
        for n in (1, 6, 12, 65)
    ),
    # materials and sections
    (Isotropic, {"E": 1e9, "density": 1, "nu": 0.5}, "found 0.5; it must be below 0.5"),
    (Isotropic, {"E": 1e9, "density": -1}, r"found -1 kg/m\^3; it must be at least 0"),
    (
        Tube,
        {"kind": "tube", "outer_radius": {"s": [0, 1], "values": [0.1]}, "thickness": 0.01},
        "found 2 arc lengths and 1 value",
    ),
    (
        Tube,
        {"kind": "tube", "outer_radius": {"s": [0, 1, 1], "values": [1, 2, 3]}, "thickness": 0.01},
        r"found arc lengths \[0.0, 1.0, 1.0\] m; they must increase",
    ),
    (
        Tube,
        {"kind": "tube", "outer_radius": {"s": [0, 1], "values": [1, -2]}, "thickness": 0.01},
        "entry 2: found -2 m; it must be at least 0 m",
    ),
    (
        Stiffness,
        {"kind": "stiffness", "EA": "2 N", "EIy": "2 N", "EIz": 1, "GJ": 1, "mass_per_length": 1},
        "a force; expected a flexural rigidity",
    ),
]

ACCEPTED: list[tuple[Any, dict[str, Any]]] = [
    (TaperTable, {"along": [0.0, 3.0], "bending": [0, 1], "torsion": [2, 0]}),
    (DeployingTable, REELED | {"reel": {"length": 2.0}, "stock": 2.0}),
    (DeployingTable, BEAM | {"mass_per_length": None, "mass": 3, "stock": 6}),
    (DeployingTable, with_functions(BEAM, y=2, family="elements", elements=9)),
    (DeployingTable, with_functions(BEAM, y=2, family="characteristic", joints=["tip"], static=True, tip=True)),
    (DeployingTable, with_functions(BEAM | {"EA": 3, "GJ": 2}, axial=1, torsion=1)),
    (DeployingTable, with_functions(BEAM | {"EIy": 0}, y=1)),
    (DeployingTable, BEAM | {"EIy": 0, "EIz": 0}),
    (DeployingTable, BEAM | {"markers": {"tip": {}, "root": {}, "a": {"fraction": 0.0}, "b": {"fraction": 1.0}}}),
    (
        DeployingTable,
        with_functions(REELED | {"length": 4, "EA": 1}, y=1, axial=2, straight=False, family="polynomial"),
    ),
    (DeployingTable, with_functions(PLATE, z=2, across=2)),
    (DeployingTable, with_functions(BLANKET, z=2, across=2, straight=False)),
    (RigidTable, {"kind": "rigid", "mass": 1, "inertia": [1, 1.2, 2.2]}),
    (RigidTable, {"kind": "rigid", "mass": 1, "inertia": [0, 2, 2]}),
    (BushingTable, {"group": "a", "rotation": [0, 0, 3]}),
    (FlexibleTable, CUT | {"damping": {"stiffness": 0.1}}),
    (FlexibleTable, CUT | {"reduction": None}),
    (FlexibleTable, DECK | {"units": "mm-t-s", "overrides": {"pid_1": {"thickness": "2 mm"}}}),
    (
        FlexibleTable,
        MESHED | {"strain": "nonlinear", "reduction": MESHED["reduction"] | {"responses": 2, "deflection": 1}},
    ),
    (MatricesTable, MATRICES | {"reduction": MESHED["reduction"] | {"derivatives": "none", "responses": 0}}),
    (RigidInterfaceTable, {"kind": "rigid", "group": "a", "position": [1, 2, 3]}),
    (RigidInterfaceTable, {"kind": "rigid", "group": "a", "position": [1, 2, 3], "reference": "b"}),
    (DampingTable, {"stiffness": 0.0}),
    (Reduction, MESHED["reduction"] | {"deflection": 0.25, "derivatives": "auto"}),
    (Reduction, MESHED["reduction"] | {"deflection": 0.25, "responses": 1}),
    (InitialTable, {"rates": [1]}),
    (InitialTable, {"marker": "t", "relative": [1, 0, 0], "length": 3, "modes": [2]}),
    (StartTable, {"from": "equilibrium", "keep": ["hinge"]}),
    (Joint, spherical(angles=[0.3, 0, 0.1])),
    (Joint, {"kind": "revolute", "child": "a", "motion": {"angle": "locked"}, "angle": 1}),
    (Joint, {"kind": "universal", "child": "a", "motion": {"angles": ["free", 1]}, "angles": [1, 0], "rates": [2, 0]}),
    (Joint, {"kind": "universal", "child": "a", "axes": [[1, 2, 3], [1, 2, 3.001]]}),
    (Joint, {"kind": "universal", "child": "a", "axes": [[0, 0, 1], [1, 0, 0]]}),
    (LoadTable, {"name": "l", "body": "a", "force": [[1, 0, 0], [2, 0, 0]], "times": [1, 1]}),
    (RunTable, {"duration": 4, "output_step": 4}),
    (RunTable, {"duration": 4, "rtol": 0.1, "samples": 2, "rho": 1.0}),
    (MeasureTable, {"of": "frequency", "channel": "q", "tone": 2, "tones": 2}),
    (MeasureTable, {"of": "system_frequency", "branch": "a"}),
    (ExpectTable, {"channel": "q", "above": "2 mm", "below": "3 m"}),
    (OrbitTable, {"semi_major_axis": 8e6, "eccentricity": 0.2}),
    (AttitudeTable, {"nominal_axes": ["-x", "z", "y"]}),
    (AttitudeTable, {"held": True, "rates": [0, 0, 0]}),
    (AttitudeTable, {"roll": 0.1, "sequence": "extrinsic zyx"}),
    (PreloadTable, {"forces": {"tip": [1, 0, 0]}}),
    (PulsesTable, {"kind": "pulses", "inputs": ["a"], "outputs": ["b"], "full": 1, "period": 2, "minimum_on": 1.999}),
    (SensorTable, {"kind": "joint", "coordinate": "a.angle", "bias": [1, 2]}),
    (SensorTable, {"kind": "strain", "body": "a", "component": "axial", "period": 1, "bias": [1], "point": [1, 2, 3]}),
    (SensorTable, {"kind": "velocity", "body": "a", "other_body": "b", "bias": [1, 2, 3]}),
    (WheelTable, {"body": "a", "inertia": 1, "inertia_in_body": "contained", "max_speed": 3, "initial_speed": -3}),
    (
        ThrusterTable,
        {"body": "a", "thrust": 1, "command": "c.x", "switched": True, "tank": "t", "specific_impulse": 300},
    ),
    (CampbellTable, {"speeds": "0:60 rpm:2"}),
    (CampbellTable, {"speeds": [0.0, "60 rpm"]}),
    (AxisTable, {"between": [1, 2], "points": 2001}),
    (StabilityTable, {"vary": {"k_roll": {"between": [0, 1]}, "k_yaw": {"between": [0, 1]}}, "inertia": "hub"}),
    (StabilityTable, {"of": "motion", "vary": {"a": {"between": [0, 1]}}, "period": 2, "shooting": True}),
    (SweepTable, SWEEP | {"vary": {"a": HALF, "b": {"values": [1, 3]}}, "design": "list", "percentiles": [0, 100]}),
    (SweepTable, SWEEP | {"vary": {"a": HALF, "b": {"values": [1, 3, 4]}}}),
    *(
        (SweepTable, SWEEP | {"vary": {"a": {"between": [1, 2]}}, "design": "sobol_indices", "members": n})
        for n in (2, 64)
    ),
    (SweepTable, {"case": "a", "histories": ["q"], "vary": {"a": {"normal": [1, 2]}}, "design": "sobol", "members": 3}),
    (Tube, {"kind": "tube", "outer_radius": {"s": [0, 1], "values": [1, 2]}, "thickness": {"formula": "s + L"}}),
]


@pytest.mark.parametrize(
    ("kind", "table", "told"), REFUSED, ids=[f"{k}: {told[:50]}" for k, (_, _, told) in enumerate(REFUSED)]
)
def test_a_table_beyond_its_limits_is_refused_with_what_was_found(kind: Any, table: dict[str, Any], told: str):
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(kind).validate_python(table)
    assert re.search(told, str(caught.value)), str(caught.value)


@pytest.mark.parametrize(("kind", "table"), ACCEPTED)
def test_a_table_at_its_limits_is_accepted(kind: Any, table: dict[str, Any]):
    TypeAdapter(kind).validate_python(table)


@pytest.mark.parametrize(
    ("more", "strain"),
    [
        ({}, None),
        ({"preload": {"acceleration": [1, 0, 0]}}, "condensed"),
        ({"members": [{"group": "a", "family": "beam"}, {"group": "b", "family": "tether"}]}, "condensed"),
        ({"members": [{"group": "b", "family": "membrane"}]}, "condensed"),
        ({"members": [{"group": "b", "family": "membrane"}], "strain": "nonlinear"}, "nonlinear"),
        *(
            (
                {"preload": {"acceleration": [1, 0, 0]}, "reduction": MESHED["reduction"] | {"derivatives": keep}},
                "linear" if keep in ("none", 0) else "condensed",
            )
            for keep in ("none", 0, 2, "auto")
        ),
        ({"preload": {"acceleration": [1, 0, 0]}, "reduction": {"method": "nodal", "clamp": "root"}}, "linear"),
        ({"preload": {"acceleration": [1, 0, 0]}, "reduction": {"method": "free_free", "modes": 3}}, "condensed"),
    ],
)
def test_a_body_in_tension_has_condensed_strain_where_its_shapes_can_stretch(more: dict[str, Any], strain: str | None):
    assert FlexibleTable.model_validate(MESHED | more).strain == strain


@pytest.mark.parametrize(
    ("speeds", "rpm"),
    [
        ("0:400 rpm:5", [0, 100, 200, 300, 400]),
        ("10 rpm:1 rev/s:3", [10, 35, 60]),
        ("3, 5 rpm, 12", [3, 5, 12]),
        ("1 rev/s, 90 rpm, 2 rev/s", [60, 90, 120]),
    ],
)
def test_speeds_without_a_unit_have_that_of_the_last(speeds: str, rpm: list[float]):
    if speeds == "3, 5 rpm, 12":
        speeds = "3, 5, 12 rpm"
    found = CampbellTable.model_validate({"speeds": speeds}).speeds
    assert list(found) == pytest.approx([n * math.pi / 30 for n in rpm])
    unit = speeds.replace(":", ",").split(",")
    assert found.unit in ("rpm", "rev/s") and any(found.unit in part for part in unit[-2:])
    assert found.scale == pytest.approx(math.pi / 30 if found.unit == "rpm" else 2 * math.pi)


def test_listed_speeds_keep_the_unit_of_their_texts_for_reports():
    found = CampbellTable.model_validate({"speeds": [0.5, "12 rpm", "1 rev/s"]}).speeds
    assert list(found) == pytest.approx([0.5, 0.4 * math.pi, 2 * math.pi])
    assert found.unit == "rpm" and found.scale == pytest.approx(math.pi / 30)
