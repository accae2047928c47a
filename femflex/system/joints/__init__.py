"""Joints of a case: nouns that describe a `Joint`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from femflex.system.joints.balls import Free, Spherical
from femflex.system.joints.general import General
from femflex.system.joints.simple import Cylindrical, Prismatic, Revolute, Universal, Weld

AnyJoint = Annotated[
    Weld | Revolute | Prismatic | Cylindrical | Universal | Spherical | Free | General, Field(discriminator="kind")
]
