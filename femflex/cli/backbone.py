"""What `femflex modes --backbone` computes and prints: the lowest frequency over the amplitude."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from femflex.cli.tables import print_table

if TYPE_CHECKING:
    from femflex.body import FlexibleBody


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


def print_backbone(body: FlexibleBody, amplitudes: list[float]) -> None:
    """Print the frequency of the lowest mode at these amplitudes [m]."""
    data = backbone_data(body, amplitudes)
    place = ", ".join(f"{x:.4g}" for x in data["place_m"])
    print(f"free vibration in mode 1 by its amplitude at ({place}) m, frame held")
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
