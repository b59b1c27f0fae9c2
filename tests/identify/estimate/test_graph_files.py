"""Graphs with free parameters from TOML files: in Python and on the command line."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy_devices import H, plays

import hystfmu as hy
from hystfmu.cli import main

GRAPH = """format = 1
wires = [["plays.y", "out.u"]]

[free]
"plays.w0" = [0.0, inf]
"plays.w" = true
"plays.r" = { lower = 0.01, upper = 1.0, rising = true }
"out.offset" = true

[[blocks]]
name = "out"
type = "scaling"

[[blocks]]
name = "plays"
type = "backlash_sum"
values = { r = [0.1, 0.4], z0 = [0.0, 0.0] }

[[inputs]]
name = "u"
to = ["plays.u"]

[[outputs]]
name = "y"
source = "out.y"
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    u = np.sin(np.arange(600) / 20) * np.linspace(1, 0.2, 600)
    hy.Dataset(H * np.arange(600), u, 3 * plays(u, [0.2, 0.5], [0.5, 0.2], 1.0, [0, 0])).to_csv("d.csv")
    Path("my.graph.toml").write_text(GRAPH)
    return tmp_path


def test_a_file_is_fitted_in_python_and_by_the_command(folder):
    model = hy.fit(hy.read("d.csv"), Path("my.graph.toml"), starts=3)
    assert model.graph.node("plays").value("r") == pytest.approx([0.2, 0.5], abs=1e-3)
    assert [n.name for n in model.graph.nodes] == ["plays", "out"]  # sorted
    told = CliRunner().invoke(
        main, ["fit", "d.csv", "--graph", "my.graph.toml", "--set", "starts=3", "-o", "m.model.toml"]
    )
    assert told.exit_code == 0, told.output
    assert "plays.r[2]" in told.output
    assert "standard error" in told.output
    written = hy.Model.load("m.model.toml")
    assert (written.predict(hy.read("d.csv").u) == model.predict(hy.read("d.csv").u)).all()


def test_a_model_file_with_a_table_of_free_parameters_is_fitted_again(folder):
    model = hy.fit(hy.read("d.csv"), Path("my.graph.toml"), starts=1)
    model.save("m.model.toml")
    text = Path("m.model.toml").read_text()
    Path("again.graph.toml").write_text(text + '\n[free]\n"out.offset" = true\n')
    again = hy.fit(hy.read("d.csv"), Path("again.graph.toml"))
    assert list(again.fit["free"]) == ["out.offset"]


@pytest.mark.parametrize(
    ("old", "new", "wrong"),
    [
        ("format = 1\n", "", "format"),
        ('[free]\n"plays.w0" = [0.0, inf]\n', '[frees]\n"plays.w0" = [0.0, inf]\n', "frees"),
        ('"plays.w" = true', '"play.w" = true', "Did you mean"),
        ("backlash_sum", "backlash", "type of a block"),
    ],
)
def test_a_bad_file_ends_in_one_line(folder, old, new, wrong):
    Path("my.graph.toml").write_text(GRAPH.replace(old, new))
    with pytest.raises(hy.InputError, match=wrong) as e:
        hy.fit(hy.read("d.csv"), Path("my.graph.toml"))
    assert "\n" not in str(e.value)
    assert str(e.value).startswith("my.graph.toml: ")


def test_a_graph_and_a_kind_exclude_each_other(folder):
    told = CliRunner().invoke(main, ["fit", "d.csv", "--graph", "my.graph.toml", "--model", "preisach"])
    assert told.exit_code == 2
    assert "exclude each other" in told.output
    with pytest.raises(hy.InputError, match="must be those of the file"):
        hy.fit(hy.read("d.csv"), Path("my.graph.toml"), free={"out.offset": True})
