"""`hystfmu export --modelica`: the exported block, simulated by rumoca, gives what `predict` gives row by row."""

from __future__ import annotations

import itertools
from pathlib import Path

import library
import numpy as np
import pymoca.parser
import pytest
import simulate
from click.testing import CliRunner

from hystfmu.cli import main
from hystfmu.errors import InputError
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.model import Model
from hystfmu.modelica import class_name, export_modelica

SCENARIOS = library.ROOT.parents[1] / "scenarios" / "models"
EVERETT = [0.3, 0.7, 0.25, 1.1, 0.6, 0.2, 1.3, 0.9, 0.5, 0.15]
OMEGA = 2 * np.pi * 20


def chain(*nodes: Node, wires: list[tuple[str, str]] | None = None) -> Model:
    """u -> first block -> ... -> y, by the first input and output of each."""

    def port(node: Node, kind: str) -> str:
        return f"{node.name}.{node.block.of(kind)[0].name}"

    joined = [(port(a, "output"), port(b, "input")) for a, b in itertools.pairwise(nodes)]
    graph = Graph(
        nodes,
        joined if wires is None else wires,
        [Input("u", (port(nodes[0], "input"),))],
        [Output("y", port(nodes[-1], "output"))],
    )
    return Model("made", graph, step=0.01, text='blocks in a "chain"')


def large_network() -> Node:
    rng = np.random.default_rng(3)
    n = 250
    return Node(
        "network",
        "mlp",
        {"n_in": 3, "n_hidden": n, "n_out": 1},
        {"W1": rng.normal(size=3 * n), "b1": rng.normal(size=n), "W2": rng.normal(size=n) / n, "activation": "tanh"},
    )


def bank() -> Node:
    return Node("bank", "play_bank", {"n": 3}, {"r": [0.1, 0.2, 0.4]})


G0 = {"a": [1, 2 * 0.3 * OMEGA, OMEGA**2], "b": [0.01, OMEGA**2]}
MODELS = {
    "zhao_tan": chain(Node("input", "scaling", {"n": 1}, {"gain": [1.3]}), Node("operator", "zhao_tan")),
    "constraint_factor": chain(Node("operator", "constraint_factor", {"m": 2}, {"a0": 0.5, "a": [1, 0.05]})),
    "krasnoselskii_pokrovskii": chain(
        Node("hysteresis", "krasnoselskii_pokrovskii", {"n": 2}, {"a": 0.5, "p1": [-0.4, -0.2], "p2": [-0.1, 0.2]})
    ),
    "preisach": chain(Node("relays", "preisach", {"n": 4}, {"E": EVERETT, "lo": -1.2, "hi": 1.2, "start": "low"})),
    "bouc_wen": chain(Node("operator", "bouc_wen", {}, {"beta": 0.9, "gamma": -0.3})),
    "duhem": chain(Node("operator", "duhem", {"m": 0, "q": 1}, {"k": 0.3})),
    "creep_and_bend": chain(
        Node("hysteresis", "backlash_sum", {"n": 2}, {"w0": 0.5}),
        Node("lag", "creep", {"n": 2}, {"T": [0.02, 0.3], "start": "steady"}),
        Node("bend", "dead_zones", {"n": 2}, {"r": [-0.2, 0.3]}),
    ),
    "inverses": chain(Node("inverse", "prandtl_ishlinskii_inverse", {"n": 2}), Node("next", "zhao_tan_inverse")),
    "delayed_rate": chain(Node("delay", "delay", {"n": 2}), Node("rate", "differentiator", {}, {"tau": 0.02})),
    "g0_held": chain(Node("hysteresis", "prandtl_ishlinskii", {"n": 1}), Node("g0", "transfer_function", {}, G0)),
    "g0_straight": chain(Node("g0", "transfer_function", {}, G0 | {"hold": "foh", "start": "steady"})),
    "large_network": chain(bank(), large_network()),
    "narx": chain(Node("network", "polynomial_narx", {"n_f": 0, "n_y": 2, "q": 2})),
}


def simulated(folder: Path, package: str, h: float, rows: int, signal: str) -> tuple[np.ndarray, np.ndarray]:
    """Inputs and outputs of package.Model at 0, h, 2 h, ... for an input as a Modelica expression of time."""
    driver = folder / "driver" / "Driver.mo"
    driver.parent.mkdir()
    # rumoca 0.10.2 loads those libraries only that the file itself names
    driver.write_text(
        f"model Driver\n  import HystFMU;\n  {package}.Model tested;\nequation\n  tested.u = {signal};\nend Driver;\n"
    )
    out = folder / "r.npz"
    stop = repr((rows + 0.5) * h)
    complaint = simulate.rumoca(driver, "Driver", stop, repr(h), "1e-10", out, beside=folder / package)
    assert not complaint, complaint
    with np.load(out) as file:
        now = simulate.Trajectory({k: file[k] for k in file.files}).at(h)
    return now["tested.u"], now["tested.y"]


SIGNAL = "{a}*(0.7*sin(5.1*time) + 0.3*sin(23*time + 0.4))"


@pytest.mark.parametrize("name", MODELS)
def test_exported_block_gives_what_predict_gives(name: str, tmp_path: Path) -> None:
    model = MODELS[name]
    export_modelica(model, tmp_path, name, "a test")
    u, y = simulated(tmp_path, class_name(name), 0.01, 150, SIGNAL.format(a=1.1))
    expected = model.predict(u)
    assert np.ptp(expected) > 0.01
    assert np.abs(y - expected).max() <= 1e-11 * np.abs(expected).max()


@pytest.mark.parametrize(
    "file",
    ["backlash_identified", "backlash_zhao_tan_inverse", "backlash_learned_inverse", "bouc_wen_zhao_tan_inverse"],
)
def test_exported_model_file_gives_what_predict_gives(file: str, tmp_path: Path) -> None:
    path = SCENARIOS / f"{file}.model.toml"
    done = CliRunner().invoke(main, ["export", str(path), "--modelica", str(tmp_path)])
    assert done.exit_code == 0, done.output
    model = Model.load(path)
    h = model.step or 1.0
    u, y = simulated(tmp_path, class_name(file), h, 150, SIGNAL.format(a=1.1).replace("time", f"(time*{0.01 / h!r})"))
    expected = model.predict(u)
    assert np.abs(y - expected).max() <= 1e-11 * np.abs(expected).max()


def test_both_parsers_read_every_exported_file(tmp_path: Path) -> None:
    for name, model in MODELS.items():
        for file in export_modelica(model, tmp_path, name, 'a "quoted" <test> & more').glob("*.mo"):
            assert pymoca.parser.parse(file.read_text()) is not None, file


def test_record_of_the_library_is_up_to_date() -> None:
    import data_record

    for name, text in data_record.records().items():
        assert (library.ROOT / "Data" / f"{name}.mo").read_text() == text, "run 'python tests/modelica/data_record.py'"


@pytest.mark.parametrize(
    ("node", "message"),
    [
        (Node("plant", "bouc_wen_oscillator"), "no class for the block 'bouc_wen_oscillator'"),
        (Node("network", "polynomial_narx", {"q": 4, "n_f": 0}), "degrees up to 3; network has q = 4"),
    ],
)
def test_a_block_without_a_class_is_one_line(node: Node, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        export_modelica(chain(node), tmp_path, "none", "a test")
    assert list(tmp_path.iterdir()) == []


def test_export_needs_something_to_write() -> None:
    done = CliRunner().invoke(main, ["export", str(SCENARIOS / "backlash_identified.model.toml")])
    assert done.exit_code == 2
    assert "-o X.fmu or --modelica DIR" in done.output
