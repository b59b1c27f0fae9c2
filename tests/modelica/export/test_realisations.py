"""Exports in continuous time: what the realisations give, units of measure at the ports, why one is left out."""

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import exported
import numpy as np
import pytest
import realisation_table
from invoked import invoked

from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.model import Model
from hystfmu.modelica import export_modelica
from hystfmu.modelica.measures import per_second, si
from hystfmu.modelica.realisation import kinds, left_out, missing

QUICK = ("g0_prandtl_ishlinskii",)  # also the start of dynamics behind events


@pytest.mark.turn("exported Modelica")
@pytest.mark.some(1)
@pytest.mark.parametrize(
    "key", [k if k in QUICK else pytest.param(k, marks=pytest.mark.stress) for k in exported.CONTINUOUS_KEYS]
)
def test_realisations_give_what_predict_gives(key: str, tmp_path: Path) -> None:
    found = exported.compare_realisations(exported.small(key), key, tmp_path)
    assert found
    for o in found:
        print(exported.line(o))
        assert o.good, exported.line(o)


def micrometres(key: str = "play_bank") -> Model:
    """Two plays from volts to micrometres, a scaling of the input in front."""
    nodes = [
        Node("input", "scaling", {"n": 1}, {"gain": [0.02], "offset": [-1.0]}),
        Node("plays", "prandtl_ishlinskii", {"n": 2}, {"r": [0.1, 0.3], "w": [0.5, 1.0], "w0": 0.2, "u0": -1.0}),
    ]
    graph = Graph(
        nodes,
        [("input.y[1]", "plays.u")],
        [Input("u", ("input.u[1]",), unit="mV")],
        [Output("y", "plays.y", unit="um")],
    )
    return Model(key, graph, 1e-3, "two plays", provenance={"span_u": [0.0, 100.0]})


@pytest.mark.turn("exported Modelica")
def test_ports_are_in_si_units(tmp_path: Path) -> None:
    """Millivolts and micrometres of the model are volts and metres at the ports; the loop is the same."""
    model = micrometres()
    package = export_modelica(model, tmp_path, "Piezo")
    ports = (package / "Ports.mo").read_text()
    assert 'RealInput u(unit = "V", displayUnit = "mV")' in ports
    assert 'RealInput du(unit = "V/s") if usesRate' in ports
    assert 'RealOutput y(unit = "m", displayUnit = "um")' in ports
    assert exported.complaints(package) == []
    rows = exported.simulated(package)
    assert 0.05 < np.ptp(rows["tested.u"]) <= 0.1
    expected = model.predict(1e3 * rows["tested.u"])
    assert np.abs(rows["tested.y"] * 1e6 - expected).max() <= 1e-12 * np.ptp(expected)
    for o in exported.compare_realisations(model, "Again", tmp_path):
        assert o.good, exported.line(o)


@pytest.mark.parametrize(("unit", "expected"), [
    ("um", ("m", 1e-6)), ("kV/mm", ("V/m", 1e6)), ("Oe", ("A/m", 1e3 / (4 * np.pi))), ("", ("", 1.0)),
    ("furlong", ("", 1.0)),
])  # fmt: skip
def test_unit_of_measure_in_si(unit: str, expected: tuple[str, float]) -> None:
    assert si(unit)[0] == expected[0]
    assert si(unit)[1] == pytest.approx(expected[1], rel=1e-15)


def test_rate_of_a_unit() -> None:
    assert [per_second(u) for u in ("", "V", "A/m")] == ["1/s", "V/s", "A/(m.s)"]


@pytest.mark.stress
def test_limits_of_a_scaling_hold_the_rate(tmp_path: Path) -> None:
    """Beyond the limits of a scaling nothing moves behind it: the rate there is 0, not that of the port."""
    model = micrometres()
    limited = model.graph.node("input").values | {"lo": [20.0], "hi": [70.0]}
    graph = model.graph.replace(Node("input", "scaling", {"n": 1}, limited))
    for o in exported.compare_realisations(replace(model, graph=graph), "Limited", tmp_path):
        assert o.good, exported.line(o)


@pytest.mark.parametrize(("key", "has", "lacks"), [
    ("preisach", ["Events"], {"Smooth": "hysteresis (preisach) changes its branch at .* no smooth form; take Events"}),
    ("duhem", ["Smooth"], {"Events": "operator (duhem) has no closed form .*; take Smooth"}),
    ("narx_network", [], dict.fromkeys(("Events", "Smooth"), "network (narx_network) goes from sample .*; take Model")),
])  # fmt: skip
def test_reason_is_said_where_a_realisation_is_left_out(
    key: str, has: list[str], lacks: dict[str, str], tmp_path: Path
) -> None:
    """In the package, by the command, in one line each; what a model lacks has no file."""
    model = exported.small(key)
    assert kinds(model.graph) == has
    model.save(tmp_path / "piezo.model.toml")
    done = invoked(["export", str(tmp_path / "piezo.model.toml"), "--modelica", str(tmp_path)])
    assert {f.stem for f in (tmp_path / "Piezo").iterdir()} & {"Events", "Smooth"} == set(has)
    for kind, why in lacks.items():
        pattern = why.replace("(", r"\(").replace(")", r"\)")
        assert re.search(f"(?m)^no realisation {kind}: {pattern}$", done.output), done.output
        assert re.search(f"{kind}: none, because {pattern}", (tmp_path / "Piezo" / "package.mo").read_text())


QUICK_ROWS = ("narx_network", "rate_mlp", "krasnoselskii_pokrovskii", "prandtl_ishlinskii")


@pytest.mark.parametrize(
    "key", [k if k in QUICK_ROWS else pytest.param(k, marks=pytest.mark.stress) for k in exported.KEYS]
)
def test_table_of_realisations_is_up_to_date(key: str) -> None:
    rows = list(realisation_table.written())
    assert [r.split("`")[1] for r in rows] == list(exported.KEYS)
    assert realisation_table.row(exported.small(key)) in rows, "run 'python tests/modelica/export/realisation_table.py'"


def test_rate_that_is_not_of_a_port_leaves_events_out() -> None:
    """Hysteresis behind dynamics: the rate of its input is that of no port."""
    nodes = [Node("g", "transfer_function", {"na": 1, "nb": 0}, {"a": [1.0, 1.0], "b": [1.0]}), Node("h", "play_bank")]
    graph = Graph(nodes, [("g.y", "h.u")], [Input("u", ("g.u",))], [Output("y", "h.z[1]")])
    assert missing(graph, "Events") == "the rate of the input of h (play_bank) does not follow from ports; take Model"
    assert kinds(graph) == []


def two_ports(*behind: Node) -> Model:
    """Command and disturbance, added with weights and scaled, before a Bouc-Wen operator and what stands behind it."""
    nodes = [
        Node("add", "sum", {"n": 2}, {"k": [0.8, 0.4], "offset": 0.1}),
        Node("input", "scaling", {"n": 1}, {"gain": [0.9], "offset": [0.05]}),
        Node("hysteresis", "bouc_wen", {}, {"A": 1.0, "beta": 1.2, "gamma": -0.2, "alpha": 0.4}),
        *behind,
    ]
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)]
    inputs = [Input("u", ("add.u[1]",)), Input("d", ("add.u[2]",), unit="V")]
    return Model(
        "made", Graph(nodes, wires, inputs, [Output("y", f"{nodes[-1].name}.y")]), 1e-3, "two ports",
        provenance={"span_u": [-1.0, 1.0]},
    )  # fmt: skip


@pytest.mark.stress
def test_rate_is_the_sum_of_the_rates_of_ports(tmp_path: Path) -> None:
    for o in exported.compare_realisations(two_ports(), "two_ports", tmp_path):
        print(exported.line(o))
        assert o.good, exported.line(o)


def test_plant_of_the_scenarios_has_every_realisation() -> None:
    """Its disturbance is added to the command in front of the hysteresis."""
    models = Path(__file__).parents[3] / "scenarios" / "models"
    for name in ("bouc_wen_plant", "bouc_wen_static"):
        graph = Model.load(models / f"{name}.model.toml").graph
        assert kinds(graph) == ["Events", "Smooth"], left_out(graph)


def test_polygon_reaches_over_the_range_of_the_data(tmp_path: Path) -> None:
    """The smooth Zhao-Tan operator stands for branches as long as the data have, whatever their scale."""
    package = export_modelica(exported.small("zhao_tan_mlp"), tmp_path, "Piezo")
    reach = re.search(r"reach = ([\d.e-]+)", (package / "Smooth.mo").read_text())
    gain = re.search(r"input_gain\[1\] = \{([\d.e-]+)\}", (package / "Values.mo").read_text())
    assert reach is not None
    assert gain is not None
    low, high = exported.small("zhao_tan_mlp").provenance["span_u"]
    assert float(reach[1]) == pytest.approx(float(gain[1]) * (high - low), rel=1e-12)
