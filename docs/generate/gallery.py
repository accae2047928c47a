"""Gallery of the shipped cases: the purpose, the expected answers and the pictures of each.

The page docs/gallery.md and its pictures are kept with the sources, for readers of the files themselves. Both are
written by `python docs/generate/pictures.py`; a test compares the page with the cases.
"""

from __future__ import annotations

import re
from pathlib import Path

from femflex import read_case
from femflex.case import Case
from femflex.measures.measure import ExpectTable
from generate.markdown import cell, code, save, table
from generate.pictures import PICTURES, case_pictures

TOP = Path(__file__).resolve().parents[2]
HEAD = """# Gallery: all shipped cases

Each case file is example, manual page and test at once. Its head states the source of its numbers. Run any of them with
`femflex run cases/NAME.toml`. The pictures are those that its table `[pictures]` requests.

<!-- Written by docs/generate/pictures.py from the cases. -->

"""


def write(target: Path) -> None:
    """Write the page gallery.md."""
    save(target / "gallery.md", page())


def page() -> str:
    """Text of the page."""
    return HEAD + contents() + "\n".join(case_entry(path) for path in shipped_cases())


SUBJECTS = {
    "Panels and slews": (
        "panel_slew panel_slew_hard panel_on_bracket tumbling_panels panel_notch slew_spillover slew_notch stiff_mast"
    ),
    "Orbits and librations": (
        "orbiter_beam orbiter_beam_held orbiter_pitch30 orbiter_pitch_held orbiter_roll5 orbiter_roll25 orbiter_yaw30 "
        "eccentric_pitch gravity_gradient swinging_boom"
    ),
    "Deployment": (
        "orbiter_deployment orbiter_deployment_free solar_blankets unfolding_array wire_booms boom_payload "
        "tether_deployment"
    ),
    "Tethers, cables, blankets and sails": (
        "tethered_satellite hanging_chain spinning_cable blanket_array sunlit_blanket tensioned_sail sail_trim"
    ),
    "Spin, rotors and large deflections": (
        "spinner nutation_damper rotating_blade helicopter_blade spin_up spin_up_segments spinning_plate elastica"
    ),
    "Water": (
        "wet_tube released_rod drag_pendulum riser floating_beam floating_beam_shapes spar_waves mooring_line "
        "towed_cable"
    ),
    "Wheels, thrusters, sensors and controllers": (
        "cmg_manoeuvre wheel_jitter pointing_budget shaken_beam detumble "
        "magnetic_detumbling delayed_samples geostationary_momentum gimbal_antenna "
        "propellant_pendulum scole"
    ),
    "Sun, air and field": "boom_in_the_air shaded_wings sun_synchronous",
    "Moving ground": "earthquake_tower shaker_panel vehicle_bump",
    "Heat": "boom_heated boom_flutter thermal_snap eclipse_entry heated_array sail_boom tape_antenna",
    "Decks, matrices and shells": "deck_mast deck_laminate deck_half_panels boom_matrices reflector",
    "Mechanisms": "four_bar flexible_chain andrews_squeezer chaplygin_sleigh rolling_disc",
}
STILL = re.compile(r"run|[\d.]+s")  # pictures of the craft, rather than plots
THUMBNAIL = 200  # pixels


def contents() -> str:
    """Links to all cases with a small picture and their titles, by subject. Raises ValueError for a case without."""
    names = {path.stem for path in shipped_cases()}
    listed = [name for group in SUBJECTS.values() for name in group.split()]
    if sorted(listed) != sorted(names):
        raise ValueError(f"these cases are not in one subject of the gallery: {sorted(names ^ set(listed))}")
    text = ""
    for subject, group in SUBJECTS.items():
        rows = [
            [thumbnail(name), f"[{name}](#{name})", cell(read_case(TOP / "cases" / f"{name}.toml").title)]
            for name in group.split()
        ]
        text += f"**{subject}**\n\n{table(('', 'case', 'title'), rows)}\n"
    return text


def thumbnail(name: str) -> str:
    """A small picture of a case, as HTML."""
    pictures = case_pictures(name)
    picture = next((path for path in pictures if STILL.fullmatch(path.stem)), pictures[0])
    return f'<img src="{picture.relative_to(PICTURES.parent).as_posix()}" width="{THUMBNAIL}" alt="{name}">'


def shipped_cases() -> list[Path]:
    """All case files of the repository."""
    return sorted((TOP / "cases").glob("*.toml"))


def case_entry(path: Path) -> str:
    """One case: title, purpose, pictures, source and expected answers."""
    case = read_case(path)
    paragraphs = [f"## {path.stem}\n", f"**{cell(case.title)}**\n", cell(case.description) + "\n"]
    paragraphs += [
        f"![{path.stem}, {picture.stem}]({picture.relative_to(PICTURES.parent).as_posix()})\n"
        for picture in case_pictures(path.stem)
    ]
    paragraphs.append(f"Source: {cell(case.source)}\n")
    paragraphs.append(answers(case))
    return "\n".join(paragraphs)


def answers(case: Case) -> str:
    """Table of the expected answers of a case."""
    rows = [
        [code(name), cell(quantity_text(about)), cell(expected_text(about)), cell(about.source)]
        for name, about in expected_answers(case)
    ]
    return table(("name", "quantity", "expected", "source"), rows)


def expected_answers(case: Case) -> list[tuple[str, ExpectTable]]:
    """Name and table of every expected answer."""
    return list(case.expect.answers.items())


def quantity_text(about: ExpectTable) -> str:
    """Name the measured quantity in a few words."""
    words = [about.of.replace("_", " ")]
    if about.channel:
        words += ["of", about.channel]
    if about.component is not None:
        words.append(f"[{about.component}]")
    if about.body:
        words += ["of", about.body, f"mode {about.mode}" if about.of == "mode_frequency" else ""]
    if about.branch:
        words += ["of", about.branch]
    if about.speed is not None:
        words.append(f"at {about.speed:.6g} rad/s")
    if about.at is not None:
        words.append(f"at {about.at:g} s")
    return " ".join(word for word in words if word)


def expected_text(about: ExpectTable) -> str:
    """State the expected value with its tolerance, or the limits."""
    words = []
    if about.value is not None:
        words.append(f"{float(about.value):.10g}")
        if about.relative_tolerance is not None:
            words.append(f"within {about.relative_tolerance:g} of it")
        elif about.tolerance is not None:
            words.append(f"± {float(about.tolerance):g}")
    if about.above is not None:
        words.append(f"above {float(about.above):g}")
    if about.below is not None:
        words.append(f"below {float(about.below):g}")
    return " ".join(words)
