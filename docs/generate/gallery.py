"""Gallery of the shipped cases: the purpose, the expected answers and the pictures of each.

The page docs/gallery.md and its pictures are kept with the sources, for readers of the files themselves. Both are
written by `python docs/generate/pictures.py`; a test compares the page with the cases.
"""

from __future__ import annotations

from pathlib import Path

from femflex import read_case
from femflex.case import Case
from femflex.case.measure import ExpectTable
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


def contents() -> str:
    """Links to all cases with their titles."""
    rows = [[f"[{path.stem}](#{path.stem})", cell(read_case(path).title)] for path in shipped_cases()]
    return table(("case", "title"), rows) + "\n"


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
