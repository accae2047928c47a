"""Gallery of the shipped cases: what each is, its expected answers, and the pictures made from it.

The page docs/gallery.md and its pictures are kept with the sources, for readers of the files themselves. Both are
written by `python docs/generate/pictures.py`; a test compares the page with the cases.
"""

from __future__ import annotations

from pathlib import Path

from femflex import read_case
from femflex.case import Case
from femflex.case.measure import ExpectTable
from generate.markdown import cell, code, save, table
from generate.pictures import PICTURES, drawn

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
    return HEAD + contents() + "\n".join(entry(path) for path in shipped())


def contents() -> str:
    """Links to all cases with their titles."""
    rows = [[f"[{path.stem}](#{path.stem})", cell(read_case(path).title)] for path in shipped()]
    return table(("case", "title"), rows) + "\n"


def shipped() -> list[Path]:
    """All case files of the repository."""
    return sorted((TOP / "cases").glob("*.toml"))


def entry(path: Path) -> str:
    """One case: title, purpose, pictures, source and expected answers."""
    case = read_case(path)
    parts = [f"## {path.stem}\n", f"**{cell(case.title)}**\n", cell(case.description) + "\n"]
    parts += [
        f"![{path.stem}, {picture.stem}]({picture.relative_to(PICTURES.parent).as_posix()})\n"
        for picture in drawn(path.stem)
    ]
    parts.append(f"Source: {cell(case.source)}\n")
    parts.append(answers(case))
    return "\n".join(parts)


def answers(case: Case) -> str:
    """Table of the expected answers of a case."""
    rows = [
        [code(name), cell(quantity(about)), cell(expected(about)), cell(about.source)] for name, about in rows_of(case)
    ]
    return table(("name", "quantity", "expected", "source"), rows)


def rows_of(case: Case) -> list[tuple[str, ExpectTable]]:
    """Name and table of every expected answer."""
    return list(case.expect.answers.items())


def quantity(about: ExpectTable) -> str:
    """What is measured, in a few words."""
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


def expected(about: ExpectTable) -> str:
    """The expected value with its tolerance, or the limits."""
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
