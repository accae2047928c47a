"""What `femflex modes --backbone` computes and prints: the lowest frequency over the amplitude."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from femflex.cli.tables import print_table

if TYPE_CHECKING:
    from femflex.body import FlexibleBody


def free_to_stretch(file: Path, bodies: Mapping[str, FlexibleBody], number: int | None) -> dict[str, FlexibleBody]:
    """The bodies, and in place of condensed ones their nonlinear form, over the same shapes, as the case builds it."""
    found = dict(bodies)
    led = [name for name, body in bodies.items() if len(body.slaves)]
    if not led:
        return found
    from femflex.case import read_case
    from femflex.case.builders import build_each
    from femflex.studies.strain_forms import with_strain_of

    case = with_strain_of(read_case(file), led, "nonlinear")
    return found | build_each(case, led, modes=number)


def read_lengths(text: str) -> list[float]:
    """Lengths [m] of a list such as "1 mm, 0.5 cm"; plain numbers are metres.

    >>> read_lengths("1 mm, 0.02")
    [0.001, 0.02]
    """
    from femflex.case.units import UnitError, to_si

    found = []
    for part in text.split(","):
        try:
            found.append(float(part))
        except ValueError:
            try:
                found.append(to_si(part.strip(), "m"))
            except UnitError as error:
                raise ValueError(f"--backbone: {error}") from None
    return found


def print_backbone(body: FlexibleBody, amplitudes: list[float], condensed: bool = False) -> None:
    """Print the frequency of the lowest mode at these amplitudes [m]; condensed: the body stands for such a one."""
    data = backbone_data(body, amplitudes)
    place = ", ".join(f"{x:.4g}" for x in data["place_m"])
    print(f"free vibration in mode 1 by its amplitude at ({place}) m, frame held")
    if condensed:
        print("condensed strain: seen in its nonlinear form, what follows as coordinates of their own")
    rows = [
        [f"{a:.6g}", f"{f:.6g}", f"{f / data['small_hz']:.5f}"]
        for a, f in zip(data["amplitude_m"], data["frequency_hz"], strict=True)
    ]
    print_table(["amplitude m", "Hz", "over small motion"], rows)


def backbone_data(body: FlexibleBody, amplitudes: list[float]) -> dict[str, Any]:
    """What --json prints of a backbone curve."""
    from math import pi

    from femflex.studies import backbone

    found = backbone(body, 1, amplitudes)
    return {
        "place_m": found.place,
        "direction": found.direction,
        "amplitude_m": found.amplitudes,
        "frequency_hz": found.omega / (2 * pi),
        "small_hz": found.small / (2 * pi),
    }
