"""The pages: links lead somewhere, case fragments fit the schema, tables name what exists, sentences are short."""

from __future__ import annotations

import re
import statistics
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from support.pages import PAGES, TOP, blocks_of, name_of

from femflex.case import read_case
from femflex.case.schema import json_schema
from femflex.case.sweep import parse_sweep

VALIDATION = tomllib.loads((TOP / "docs" / "validation.toml").read_text(encoding="utf-8"))
ROWS = [row for rows in VALIDATION.values() for row in rows]
FRAGMENTS = [block for path in PAGES for block in blocks_of(path) if block.language == "toml"]
LINK = re.compile(r"\]\(([^)#]+)(?:#[^)]*)?\)")
GENERATED = {"api.md", "validation.md"}
# whose sentences are those of the program, and of cases
OF_PROGRAM = (TOP / "docs" / "reference", TOP / "docs" / "benchmarks")
MEDIAN, LONGEST = 14, 40  # words of a sentence


def loosened(schema: Any) -> Any:
    """The schema of a fragment of a case: nothing is required, and a kind may be left out."""
    if isinstance(schema, list):
        return [loosened(entry) for entry in schema]
    if not isinstance(schema, dict):
        return schema
    out = {
        key: loosened(entry)
        for key, entry in schema.items()
        if key not in ("required", "discriminator", "minProperties")
    }
    if "oneOf" in out:
        out["anyOf"] = out.pop("oneOf")
    return out


@pytest.fixture(scope="module")
def fragments() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(loosened(json_schema()))


@pytest.mark.parametrize("block", FRAGMENTS, ids=lambda block: f"{Path(block.page).stem}-{block.text[:24].strip()}")
def test_a_fragment_of_a_case_has_only_known_keys(block, fragments):
    if "vary" in tomllib.loads(block.text):  # the file of a sweep
        parse_sweep(block.text)
        return
    problems = [error.message[:300] for error in fragments.iter_errors(tomllib.loads(block.text))]
    assert not problems, f"{block.page}: {problems}\n{block.text}"


def test_a_wrong_key_in_a_fragment_is_found(fragments):
    assert not fragments.is_valid({"run": {"durtion": 1}})
    assert not fragments.is_valid({"joints": [{"kind": "revolute", "position": 1}]})
    assert not fragments.is_valid({"bodies": {"b": {"kind": "flexible", "inertia": [1, 1, 1]}}})


@pytest.mark.parametrize("path", PAGES, ids=name_of)
def test_links_lead_to_files(path: Path):
    for target in LINK.findall(path.read_text(encoding="utf-8")):
        if "://" not in target:
            linked = path.parent / target
            assert linked.exists() or (linked.parent.name == "generated" and linked.name in GENERATED), target


@pytest.mark.parametrize("path", [p for p in PAGES if p.parent.name == "howto" and p.name != "index.md"], ids=name_of)
def test_a_howto_page_begins_with_a_picture(path: Path):
    assert re.match(r"# .*\n\n!\[[^]]{10,}\]\(\S+\.png\)\n", path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["what"][:60])
def test_a_row_of_the_validation_names_a_command_that_exists(row: dict[str, str]):
    assert set(row) == {"what", "answer", "femflex", "command"} and all(row.values())
    files = re.findall(r"(?:tests|cases)/[\w/]+\.(?:py|toml)", row["command"])
    assert files and all((TOP / name).exists() for name in files), row["command"]


def test_the_gallery_and_the_validation_hold_every_case():
    for path in sorted((TOP / "cases").glob("*.toml")):
        assert read_case(path).expect.answers, path.stem


def test_every_case_has_small_pictures_in_the_gallery():
    folders = {path.name: sorted(path.glob("*.png")) for path in (TOP / "docs" / "gallery").iterdir()}
    assert sorted(folders) == [path.stem for path in sorted((TOP / "cases").glob("*.toml"))]
    sizes = {f"{name}/{path.name}": path.stat().st_size for name, paths in folders.items() for path in paths}
    assert all(folders.values()) and max(sizes.values()) < 60_000
    assert sum(sizes.values()) < 60_000 * len(folders)


def sentences(text: str) -> list[list[str]]:
    """Words of every sentence of a page's prose: paragraphs, entries of lists and cells of tables."""
    text = re.sub(r"<!--.*?-->|^```.*?^```|\$\$.*?\$\$", "\n\n", text, flags=re.DOTALL | re.MULTILINE)
    pieces = re.split(r"\n\s*\n|\n(?=[-#|\d])|\|", text)
    sentences_of_text = []
    for piece in pieces:
        for sentence in re.split(r"(?<=[.;:!?])\s+", " ".join(piece.split())):
            words = [word for word in sentence.split() if re.search(r"\w", word)]
            if len(words) > 3:
                sentences_of_text.append(words)
    return sentences_of_text


def test_sentences_of_the_pages_are_short():
    pages = [path for path in PAGES if path.name != "gallery.md" and path.parent not in OF_PROGRAM]
    words_by_page = [(name_of(path), words) for path in pages for words in sentences(path.read_text(encoding="utf-8"))]
    long_sentences = [(page, len(words), " ".join(words[:12])) for page, words in words_by_page if len(words) > LONGEST]
    assert not long_sentences
    assert statistics.median(len(words) for _, words in words_by_page) <= MEDIAN


def test_every_page_is_in_one_table_of_contents():
    entries = []
    for path in PAGES:
        for block in re.findall(r"```\{toctree\}\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL):
            names = [line for line in block.splitlines() if line and not line.startswith(":")]
            entries += [(path.parent / f"{name}.md").resolve() for name in names]
    assert len(entries) == len(set(entries))
    pages = {path for path in PAGES if path not in (TOP / "README.md", TOP / "docs" / "index.md")}
    assert pages <= set(entries)
