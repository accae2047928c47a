"""[environment] of a case: what it reads, what it refuses, and which strain bodies get under their weight."""

from __future__ import annotations

import numpy as np
import pytest
from support.advised_bodies import noted_system
from test_strain_selected_in_systems import BOOM, EI, HELD, LENGTH, LINE, RUN

from femflex.case import CaseError, read_case
from femflex.pipeline import prepare

GREENHILL = 7.8373  # q L^3 / EI at which a standing column falls over


def system(write_case, gravity, joint=HELD, boom=BOOM):
    return noted_system(read_case(write_case(f"{RUN}[environment]\ngravity = {gravity}\n{boom}{joint}")))


@pytest.mark.sampled(1)
@pytest.mark.parametrize(
    ("given", "read"),
    [
        ("9.81", (0, 0, -9.81)),
        ('"981 cm/s^2"', (0, 0, -9.81)),
        ('[0, "1.62 m/s^2", -1]', (0, 1.62, -1)),
        ("0", (0, 0, 0)),
    ],
)
def test_gravity_is_a_strength_along_minus_z_or_a_vector(write_case, given, read):
    assert system(write_case, given).environment.gravity == pytest.approx(np.array(read, float))


@pytest.mark.parametrize(
    ("given", "fragments"),
    [
        ("-9.81", ("environment.gravity", "found -9.81 m/s^2", "takes three numbers, such as [0, 0,")),
        ('"9.81 m/s"', ("environment.gravity", "velocity", "expected an acceleration")),
        ("[0, 9.81]", ("environment.gravity", "found 2 entries", "expected")),
        ("true", ("environment.gravity", "found true")),
    ],
)
def test_gravity_that_cannot_be_read_is_answered(write_case, given, fragments):
    with pytest.raises(CaseError) as error:
        system(write_case, given)
    for fragment in fragments:
        assert fragment in str(error.value)


def test_gravity_beside_an_orbit_is_refused_with_other_mistakes(write_case, craft):
    text = craft + "\n[orbit]\nperigee_altitude = '400 km'\n[environment]\ngravity = 9.81\nwind = 3\n"
    with pytest.raises(CaseError) as error:
        read_case(write_case(text))
    assert "environment.wind" in str(error.value) and "known are" in str(error.value)
    with pytest.raises(CaseError, match=r"environment.gravity: found \[0.0, 0.0, -9.81\] m/s\^2 together with"):
        read_case(write_case(text.replace("wind = 3\n", "")))


@pytest.mark.slow
def test_a_mast_that_stands_near_its_greenhill_length_gets_condensed_strain(write_case):
    half = GREENHILL * EI / (LINE * LENGTH**3) / 2
    standing, lying = f"[{-half}, 0, 0]", f"[0, 0, {-half}]"
    told = system(write_case, standing).bodies["boom"].note
    assert told.startswith("strain is condensed: axial compression (loads or inertia) may lower the first frequency by")
    assert float(told.split("by ")[1].split("%")[0]) == pytest.approx(100 * (1 - np.sqrt(0.5)), abs=1.0)
    sags = 2 * half * LINE * LENGTH**3 / (8 * EI)  # let go of suddenly
    told = system(write_case, lying).bodies["boom"].note
    assert float(told.split("may bend it by ")[1].split("%")[0]) == pytest.approx(100 * sags, rel=0.03)


@pytest.mark.slow
def test_a_boom_that_may_swing_down_is_judged_by_how_it_would_hang(write_case):
    hinged = '[[joints]]\nkind = "revolute"\nchild = "boom"\naxis = [0, 1, 0]\n'
    strong = GREENHILL * EI / (LINE * LENGTH**3) / 2
    assert "may bend it by" in system(write_case, f"[0, 0, {-strong}]").bodies["boom"].note
    assert "the first frequency" in system(write_case, f"[0, 0, {-strong}]", hinged).bodies["boom"].note
    locked = hinged + 'motion = { angle = "locked" }\n'
    assert "may bend it by" in system(write_case, f"[0, 0, {-strong}]", locked).bodies["boom"].note
    assert "strain is linear" in system(write_case, "[0, 0, -1e-3]", hinged).bodies["boom"].note


@pytest.mark.slow
def test_a_linear_mast_under_its_weight_is_warned_of(write_case, tmp_path, femflex):
    half = GREENHILL * EI / (LINE * LENGTH**3) / 2
    text = f"{RUN}[environment]\ngravity = [{-half}, 0, 0.01]\n{BOOM}strain = 'linear'\n{HELD}"
    path = write_case(text)
    code, said, wrong = femflex("run", path, "-o", "run.h5", "--no-pictures")
    assert code == 0 and f"gravity     ({-half:.6g}, 0, 0.01) m/s^2, inertial axes" in said
    assert "body 'boom' was compressed, by loads or inertia, so that its first frequency" in wrong
    assert "falls by 29%" in wrong
    code, said, wrong = femflex("run", path, "-o", "less.h5", "--no-pictures", "--without", "gravity")
    assert code == 0 and "without gravity" in said and "was pressed" not in wrong
    code, said, _ = femflex("terms", "run.h5")
    assert code == 0 and "gravity" in said
    code, said, _ = femflex("info", path)
    assert f"gravity ({-half:.6g}, 0, 0.01) m/s^2" in said


@pytest.mark.filterwarnings("ignore:bodies.boom. its own inertia and weight:femflex.PhysicsWarning")
def test_a_rigid_body_leaves_out_no_stiffness(write_case):
    half = GREENHILL * EI / (LINE * LENGTH**3) / 2
    text = f"{RUN}[environment]\ngravity = [{-half}, 0, 0]\n{BOOM}strain = 'linear'\n{HELD}"
    prepared = prepare(read_case(write_case(text)), write_case(text).with_name("no.h5"), without=["flexibility"])
    assert prepared.system.bodies["boom"].foreshortening is None


def test_a_bend_too_small_to_print_is_said_to_be_smaller(write_case):
    note = system(write_case, "[0, 0, -1e-6]").bodies["boom"].note
    assert "loads and motions bend it by less than 0.005% of its size" in note
