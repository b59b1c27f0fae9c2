"""`hystfmu migrate`: files as the first round wrote them, with their comments, become files of the present format."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

from hystfmu import InputError, Model
from hystfmu.cli import main
from hystfmu.face.migrate import migrate
from hystfmu.graph import Graph, Node
from hystfmu.scenario import Scenario
from hystfmu.scenario.outcome.baseline import Baseline

SCENARIO = """# a loop of two units
name = "old"   # as the folder
step = 1e-3
stop = 0.01
memory = true  # at the end of the run
order = ["source", "gain"]
coupling = { scheme = "iterative", events = "hit", most_sweeps = 9 }

[units.source]
block = "reference"
text = "memory = true, most_sweeps = 3"

[units.gain]
block = "sum"
dims = { n = 1 }

[connections]
"gain.u" = "source.r"

[metrics.peak]
kind = "peak"
signal = "gain.y"

[[case]]
name = "fast"

[case.coupling]   # its own
  most_sweeps = 30
events = 'hit'  # between two points
"""
NEW = (
    SCENARIO.replace("name = ", "format = 1\nname = ", 1)
    .replace("memory = true  #", "final_states = true  #")
    .replace('events = "hit", most_sweeps = 9', 'events = "located", max_sweeps = 9')
    .replace("  most_sweeps = 30", "  max_sweeps = 30")
    .replace("events = 'hit'", 'events = "located"')
)


def test_a_scenario_keeps_its_comments(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text(SCENARIO)
    with pytest.raises(InputError, match=r"hystfmu migrate FILE"):
        Scenario(tmp_path)
    told = migrate(file)
    assert file.read_text() == NEW
    assert told == [
        "format = 1",
        "memory -> final_states",
        "coupling.events -> events = 'located'",
        "coupling.most_sweeps -> max_sweeps",
        "case.coupling.most_sweeps -> max_sweeps",
        "case.coupling.events -> events = 'located'",
    ]
    assert Scenario(tmp_path).spec.case[0].coupling.max_sweeps == 30  # type: ignore[union-attr]
    assert migrate(file) == []
    assert file.read_text() == NEW


def test_a_word_and_a_baseline_of_before_are_refused_with_the_verb(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text(NEW.replace('events = "located", max', 'events = "hit", max'))
    with pytest.raises(InputError, match=r"coupling.events: The word is now 'located' \(hystfmu migrate FILE\)"):
        Scenario(tmp_path)
    baseline = tmp_path / "baseline.toml"
    baseline.write_text("# generated\n[case.a.metrics]\npeak = 1.0\n\n[case.a.memory]\nsource = 'ab'\n")
    (tmp_path / "baseline.csv").write_text("case,t,gain.y\n")
    with pytest.raises(InputError, match=r"memory: The key is now 'final_states' \(hystfmu migrate FILE\)"):
        Baseline.load(tmp_path)


@pytest.mark.parametrize("memory", ["memory = { source = 'ab' }", "[case.a.memory]\nsource = 'ab'"])
def test_a_baseline_is_migrated(memory: str, tmp_path: Path) -> None:
    baseline = tmp_path / "baseline.toml"
    baseline.write_text(f"# generated\n[case.a]\nmetrics = {{ peak = 1.0 }}\n{memory}\n")
    assert migrate(baseline) == ["case.a.memory -> final_states"]
    assert baseline.read_text().startswith("# generated\n")
    assert tomllib.loads(baseline.read_text())["case"]["a"]["final_states"] == {"source": "ab"}


@pytest.mark.parametrize("old", ["", "format = 0\n"])
def test_a_model_gets_its_format(old: str, tmp_path: Path) -> None:
    file = tmp_path / "m.model.toml"
    model = Model("sum", Graph.single(Node("sum", "sum")), 1e-3)
    model.save(file)
    text = file.read_text()
    assert text.count("format = 1\n") == 1
    file.write_text(text.replace("format = 1\n", old))
    done = CliRunner().invoke(main, ["predict", str(file), str(file), "-o", "x.csv"])
    assert done.exit_code == 2
    assert f"hystfmu migrate {file}" in done.output.replace("\n", " ")
    done = CliRunner().invoke(main, ["migrate", str(file)])
    assert done.exit_code == 0, done.output
    assert done.output == f"{file}: format = 1\n"
    assert file.read_text() == text
    assert Model.load(file).graph.to_bytes() == model.graph.to_bytes()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("format = 9\nkey = 'x'\nblocks = []\n", "Got 9 of a newer version of HystFMU: pip install"),
        ("a = 1\nb = 2\n", "must be a model, a scenario or a baseline. Got the keys a, b."),
        ("order = []\ncoupling = {\n most_sweeps = 3 }\n", "valid TOML"),
        ("order = []\ncase = [{ name = 'a', coupling = { most_sweeps = 3 } }]\n", "lines of their own. Change by hand"),
    ],
)
def test_what_cannot_be_migrated_stays_as_it_is(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "x.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=words) as e:
        migrate(file)
    assert str(file) in str(e.value)
    assert file.read_text() == text
