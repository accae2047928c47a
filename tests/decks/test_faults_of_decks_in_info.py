"""What `femflex info` says of a deck that is at fault and whose mesh has coordinate systems of its own."""

from __future__ import annotations

from pathlib import Path

from support.nastran_decks import bar, written
from typer.testing import CliRunner

from femflex.cli.app import app


def test_the_faults_of_a_deck_with_local_systems_are_told_before_those_of_its_mesh(tmp_path: Path):
    local = ["CORD2R,4,,0.,0.,0.,0.,0.,1.", ",1.,0.,0.", "GRID,50,4,0.,0.,1.", "CONM2,60,99,,2."]
    done = CliRunner().invoke(app, ["info", str(written(tmp_path, *bar(2), *local))])
    said = " ".join(done.output.split())
    assert done.exit_code == 2
    assert "CONM2 60 uses grid point 99, which no GRID card defines" in said
    assert "as a mesh: deck.bdf: 1 GRID cards, the first is 50, are given in a local coordinate system" in said
    assert said.index("CONM2 60") < said.index("as a mesh")
