"""The lowest frequency over the amplitude, as `femflex modes --backbone` computes and prints it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from femflex.cli.tables import print_table

if TYPE_CHECKING:
    from femflex.body import FlexibleBody
    from femflex.studies import Backbone, BackboneError


def read_lengths(text: str) -> list[float]:
    """Read the lengths [m] of a list such as "1 mm, 0.5 cm"; plain numbers are metres.

    >>> read_lengths("1 mm, 0.02")
    [0.001, 0.02]
    """
    from femflex.noun.units import UnitError, to_si

    lengths = []
    for entry in text.split(","):
        try:
            lengths.append(float(entry))
        except ValueError:
            try:
                lengths.append(to_si(entry.strip(), "m"))
            except UnitError as error:
                raise ValueError(f"--backbone: {error}") from None
    return lengths


def print_backbone(body: FlexibleBody, amplitudes: list[float]) -> None:
    """Print the frequency of the lowest mode at these amplitudes [m].

    Raises BackboneError where they are not all reached, after those that are.
    """
    data, error = backbone_data(body, amplitudes)
    if data:
        _print_curve(data)
    if text := amplitude_note(body):
        print(text)
    if error is not None:
        raise error


def _print_curve(data: dict[str, Any]) -> None:
    point_text = ", ".join(f"{x:.4g}" for x in data["place_m"])
    print(f"free vibration in mode 1 by its amplitude at ({point_text}) m, frame held")
    rows = [
        [f"{a:.6g}", f"{f:.6g}", f"{f / data['small_hz']:.5f}"]
        for a, f in zip(data["amplitude_m"], data["frequency_hz"], strict=True)
    ]
    print_table(["amplitude m", "Hz", "over small motion"], rows)
    for low, high in data["gaps_m"]:
        print(
            f"between {low:.4g} and {high:.4g} m a higher harmonic is in internal resonance with another "
            "mode; the curve is not computed there"
        )


def backbone_data(body: FlexibleBody, amplitudes: list[float]) -> tuple[dict[str, Any], BackboneError | None]:
    """Return the backbone curve for --json, as far as it was computed, and the error that ended it."""
    from math import pi

    from femflex.studies import BackboneError, backbone

    error: BackboneError | None = None
    curve: Backbone | None
    try:
        curve = backbone(body, 1, amplitudes)
    except BackboneError as stopped:
        error, curve = stopped, stopped.backbone
    if curve is None:
        return {}, error
    return {
        "place_m": curve.place,
        "direction": curve.direction,
        "amplitude_m": curve.amplitudes,
        "frequency_hz": curve.omega / (2 * pi),
        "small_hz": curve.small / (2 * pi),
        "gaps_m": curve.gaps,
        "path": [(vibration.amplitude, vibration.omega / (2 * pi)) for vibration in curve.path],
        "note": amplitude_note(body),
    }, error


def amplitude_note(body: FlexibleBody) -> str:
    """Note on a frequency that cannot change with the amplitude; empty for one that can."""
    if body.strain_form != "linear":
        return ""
    return (
        "linear strain: its force is proportional to the amplitude, so that the frequency cannot change with it; "
        "give the body strain = 'condensed' or 'nonlinear' to see what a large amplitude does"
    )
