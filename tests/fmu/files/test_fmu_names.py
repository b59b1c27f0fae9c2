"""FMUs of two devices differ in name, title and description, and their ports say what they are."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any, Literal

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.cli import main


def hystfmu(*words: object) -> str:
    done = CliRunner().invoke(main, [str(w) for w in words])
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Records of two stacks with German headings, and a model of the same kind of each."""
    there = tmp_path_factory.mktemp("records")
    data = hy.synthetic.piezo(60, 1000.0)
    for name, scale in (("Mess 1", 1.0), ("Mess 2", 1.5)):
        rows = np.column_stack([data.t, scale * data.u, scale * data.y])
        np.savetxt(there / f"{name}.csv", rows, delimiter=",", header="Zeit [s],Spannung [V],Weg [um]", comments="")
        out = there / f"{name}.model.toml"
        hystfmu("fit", there / f"{name}.csv", "--model", "prandtl_ishlinskii", "--set", "N=8", "-o", out)
    return there


def described(path: Path) -> tuple[Any, str]:
    """The description of an FMU, and the title of its page."""
    with zipfile.ZipFile(path) as archive:
        (title,) = re.findall("<title>(.*)</title>", archive.read("documentation/index.html").decode())
    return fmpy.read_model_description(str(path)), title


@pytest.mark.parametrize("fmi", [2, 3])
def test_two_devices(folder: Path, tmp_path: Path, fmi: int) -> None:
    made = []
    for name in ("Mess 1", "Mess 2"):
        out = tmp_path / f"{name}.fmu"
        hystfmu("export", folder / f"{name}.model.toml", "--fmi", fmi, "--source", "-o", out)
        again = hy.Model.load(folder / f"{name}.model.toml").export(tmp_path / "again.fmu", fmi, name, source=True)  # type: ignore[arg-type]
        assert again.read_bytes() == out.read_bytes()
        made.append(described(out))
    (one, title), (two, other) = made
    assert (one.modelName, title) == ("Mess 1", "Mess 1")
    assert (two.modelName, other) == ("Mess 2", "Mess 2")
    for found, name, high in ((one, "Mess 1", 100), (two, "Mess 2", 150)):
        assert found.coSimulation.modelIdentifier == found.modelExchange.modelIdentifier == name.replace(" ", "_")
        model = hy.Model.load(folder / f"{name}.model.toml")
        assert found.description.startswith(f"{model.text}; fitted to the record {name}: ")
        assert f"input 0 to {high} V, output in um, RMS error {model.fit['rms_percent']:.2g} %" in found.description
        assert model.provenance["sha256"][:8] in found.description
        ports = {v.name: v.description for v in found.modelVariables}
        assert (ports["u"], ports["y"]) == ("Spannung, in V", "Weg, in um")


def test_a_model_in_memory_is_named_after_its_record(folder: Path, tmp_path: Path) -> None:
    names = set()
    for record in ("Mess 1", "Mess 2"):
        model = hy.Model.load(folder / f"{record}.model.toml")
        forward, _ = described(model.export(tmp_path / "m.fmu"))
        back, _ = described(model.inverse().export(tmp_path / "i.fmu"))
        assert forward.modelName == f"{record} prandtl_ishlinskii"
        assert back.modelName == f"{record} prandtl_ishlinskii_inverse"
        assert f"fitted to the record {record}: " in back.description
        assert {v.name: v.description for v in back.modelVariables}["y"] == "input that gives it: Spannung, in V"
        names |= {forward.description, back.description}
    assert len(names) == 4


def test_what_no_record_names(tmp_path: Path) -> None:
    t = np.arange(400) * 1e-3
    u = 50 * (1 - np.cos(20 * t)) * np.exp(-t)
    y = 0.3 * u + 0.1 * np.maximum.accumulate(u)
    model = hy.fit(hy.Dataset(t, u, y, name="bench", unit_y="um"), "prandtl_ishlinskii", N=4)
    ports = {v.name: v.description for v in described(model.export(tmp_path / "m.fmu"))[0].modelVariables}
    assert (ports["u"], ports["y"]) == ("input of the record bench", "output of the record bench, in um")


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    ("name", "identifier"), [("a b", "a_b"), ("1a", "_1a"), ("Größe 1", "Gr__e_1"), ("a" * 300, "a" * 60)]
)
def test_any_name_has_an_identifier(tmp_path: Path, fmi: Literal[2, 3], name: str, identifier: str) -> None:
    found, title = described(hy.Model("sum", hy.blocks.Sum().graph).export(tmp_path / "x.fmu", fmi, name))
    assert (found.modelName, title) == (name, name)
    assert found.coSimulation.modelIdentifier == identifier
    with zipfile.ZipFile(tmp_path / "x.fmu") as archive:
        assert [n for n in archive.namelist() if re.fullmatch(rf"binaries/[^/]*/{identifier}\..*", n)]
