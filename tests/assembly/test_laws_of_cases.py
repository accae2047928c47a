"""[[joints.laws]] of case files: what each becomes, and the sentence for each mistake."""

import numpy as np
import pytest
from test_motion import joint, problems

from femflex.system import Friction, Latch, Stop, TabulatedDamper, TabulatedSpring

HINGE = "kind = 'revolute'\n[[joints.laws]]\n"


def test_each_kind_becomes_its_law():
    found = joint(
        HINGE
        + "kind = 'spring'\nat = [0, '90 deg']\nforce = [0, '2 N m']\nname = 'tape'\n"
        + "[[joints.laws]]\nkind = 'damper'\nrate = [0, 1]\nforce = [0, 3]\n"
        + "[[joints.laws]]\nkind = 'stop'\nlower = '-10 deg'\nupper = 1\n"
        + "stiffness = 100\ndamping = 2\nwidth = '1 deg'\n"
        + "[[joints.laws]]\nkind = 'friction'\nforce = 0.5\nvelocity = '1 deg/s'\n"
        + "[[joints.laws]]\nkind = 'latch'\nat = '90 deg'\n"
    )
    spring, damper, stop, friction = found.laws
    assert isinstance(spring, TabulatedSpring) and spring.stretch == pytest.approx((0, np.pi / 2))
    assert isinstance(damper, TabulatedDamper) and damper.resisting == (0, 3)
    assert isinstance(stop, Stop) and (stop.upper, stop.stiffness, stop.damping) == (1, 100, 2)
    assert [stop.lower, stop.width] == pytest.approx(np.radians([-10, 1]))
    assert isinstance(friction, Friction) and friction.velocity == pytest.approx(np.radians(1))
    assert found.law_names() == ["tape", "hub-arm.damper", "hub-arm.stop", "hub-arm.friction"]
    assert found.latches[0] == Latch(0, pytest.approx(np.pi / 2))


def test_the_coordinate_says_the_unit_and_the_freedom():
    found = joint(
        "kind = 'cylindrical'\n[[joints.laws]]\nkind = 'latch'\ncoordinate = 'slide'\nat = '20 cm'\nstiffness = 9\n"
    )
    assert found.latches[0] == Latch(0, pytest.approx(0.2), 9)
    found = joint(
        "kind = 'universal'\n[[joints.laws]]\nkind = 'friction'\ncoordinate = 'angle2'\nforce = 1\nvelocity = 1\n"
    )
    assert found.laws[0].freedom == 1


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ("kind = 'stp'", "found kind = 'stp'; did you mean 'stop'?"),
        ("kind = 'stop'\nuper = 1\nstiffness = 1", "found key 'uper' in a stop; did you mean 'upper'?"),
        ("kind = 'stop'\nupper = 1", "key 'stiffness' of the stop is missing"),
        (
            "kind = 'stop'\nlower = 1\nupper = 0\nstiffness = 1",
            "the lower limit 1 of a stop is not below its upper limit 0",
        ),
        ("kind = 'stop'\nupper = '1 m'\nstiffness = 1", "upper: found '1 m', which is a length; expected an angle"),
        ("kind = 'friction'\nforce = -1\nvelocity = 1", "the limit must not be negative"),
        ("kind = 'latch'\nat = 0\n", "starts at 0, where it latches"),
        ("kind = 'latch'\nat = 1\ncoordinate = 'slide'", "found coordinate = 'slide', which the joint does not have"),
        ("kind = 'spring'\nat = [0, 1]\nforce = [0]", "found 2 places and 1 force in a spring; give as many of both"),
        ("kind = 'spring'\nat = [1, 0]\nforce = [0, 1]", "a tabulated spring must ascend"),
        ("kind = 'damper'\nrate = [0, 1]\nforce = [0, -1]", "drives the joint; it must resist"),
    ],
)
def test_a_mistake_is_told_with_its_place(given, text):
    told = problems(HINGE + given + "\n")
    assert "joints[arm]" in told and text in told


def test_laws_need_a_free_coordinate_of_their_own():
    law = "[[joints.laws]]\nkind = 'latch'\nat = 1\n"
    assert "a latch on a joint without a slide or turn of its own" in problems("kind = 'weld'\n" + law)
    assert "key 'coordinate' of the latch is missing" in problems("kind = 'universal'\n" + law)
    told = problems("kind = 'revolute'\nmotion.angle = 'locked'\n" + law)
    assert "found a latch on 'angle', whose motion is prescribed" in told
