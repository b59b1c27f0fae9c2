"""`hystfmu export --modelica`: what the exported block gives in rumoca is what `predict` gives, row by row."""

import re
from dataclasses import replace
from pathlib import Path

import exported
import library
import numpy as np
import pytest
import simulate
from invoked import invoked
from made_graphs import MADE, chain

import hystfmu as hy
from hystfmu.core.library import block_types
from hystfmu.graph import Graph, Node
from hystfmu.modelica import classes, export_modelica
from hystfmu.modelica.literals import number
from hystfmu.modelica.record import record

QUICK_KEYS = ("preisach", "play_bank_mlp", "g0_prandtl_ishlinskii", "g0_jiles_atherton")


@pytest.mark.turn("exported Modelica")
@pytest.mark.some(1)
@pytest.mark.parametrize("key", QUICK_KEYS)
def test_exported_kind_gives_what_predict_gives(key: str, tmp_path: Path) -> None:
    check(exported.compare(exported.small(key), key, tmp_path))


@pytest.mark.stress
@pytest.mark.parametrize("key", [k for k in exported.KEYS if k not in QUICK_KEYS])
def test_every_kind_gives_what_predict_gives(key: str, tmp_path: Path) -> None:
    check(exported.compare(exported.small(key), key, tmp_path))


LONG = ("sources", "large_network", "in_range")


@pytest.mark.turn("exported Modelica")
@pytest.mark.some(1)
@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.stress) if n in LONG else n for n in MADE])
def test_exported_graph_gives_what_predict_gives(name: str, tmp_path: Path) -> None:
    check(exported.compare(MADE[name](), name, tmp_path))


def test_model_without_a_step_asks_for_one(tmp_path: Path) -> None:
    """A block that is discretised for 1 s would be another one."""
    model = MADE["nfir_without_auxiliary"]()
    replace(model, graph=replace_step(model.graph), step=None).save(tmp_path / "plant.model.toml")
    command = ["export", str(tmp_path / "plant.model.toml"), "--modelica", str(tmp_path)]
    asked = invoked(command, status=2)
    assert "the model has no sample period: give --step SECONDS, or step in the model file" in asked.output
    invoked([*command, "--step", "0.002"])
    assert "Ts = 0.002" in (tmp_path / "Plant" / "Values.mo").read_text()
    model.save(tmp_path / "with.model.toml")
    refused = invoked(
        ["export", str(tmp_path / "with.model.toml"), "--modelica", str(tmp_path), "--step", "0.002"], status=2
    )
    assert "--step must not be given: the model has a step of 0.01 s" in refused.output


TIED = [
    Node("part", "transfer_function"), Node("part", "delay", {"n": 2}), Node("part", "iterative_learning"),
    Node("part", "narx_network"), Node("part", "polynomial_narx", {"n_f": 0}), Node("part", "repetitive"),
]  # fmt: skip


@pytest.mark.turn("exported Modelica")
@pytest.mark.some(1)
@pytest.mark.parametrize("node", TIED, ids=lambda n: n.type)
def test_block_refuses_a_sample_period_that_it_is_not_for(node: Node, tmp_path: Path) -> None:
    """Matrices for one period, and lags and periods that are numbers of samples."""
    package = export_modelica(chain(node), tmp_path, "Piezo")
    file = package / "Chosen.mo"
    for Ts, says in ((0.01, ""), (0.02, "Ts must be 0.01 s, for which the dynamics and lags are computed")):
        file.write_text(
            f"within Piezo; model Chosen import HystFMU; Model tested(Ts = {Ts}); equation tested.u = time; end Chosen;"
        )
        settings = ("0.1", "0.01", "1e-8", tmp_path / "r.npz")
        complaint = simulate.rumoca(file, "Piezo.Chosen", *settings, packages=(library.ROOT, package))
        assert says in complaint, complaint
        assert bool(says) == bool(complaint), complaint


@pytest.mark.parametrize("name", MADE)
def test_only_a_block_that_is_another_one_refuses_a_sample_period(name: str, tmp_path: Path) -> None:
    types = {n.type for n in MADE[name]().graph.nodes}
    text = (export_modelica(MADE[name](), tmp_path, "Made") / "Model.mo").read_text()
    assert ("Ts must be 0.01 s" in text) == bool(types & {n.type for n in TIED})


@pytest.mark.parametrize("name", MADE)
def test_every_sampled_model_without_a_step_asks_for_one(name: str, tmp_path: Path) -> None:
    model = MADE[name]()
    without = replace(model, step=None)
    if any(map(classes.is_sampled, model.graph.nodes)):
        with pytest.raises(hy.InputError, match="the model has no sample period: give --step SECONDS"):
            export_modelica(without, tmp_path, "Asked")
    else:
        assert "Ts = 1.0" in (export_modelica(without, tmp_path, "Asked") / "Values.mo").read_text()


def replace_step(graph: Graph) -> Graph:
    return Graph(list(graph.nodes), list(graph.wires), list(graph.inputs), list(graph.outputs), sort=False)


def check(o: exported.Outcome) -> None:
    print(exported.line(o))
    assert o.error <= o.bound


@pytest.mark.some(2)
@pytest.mark.parametrize(("old", "new", "says"), [
    ("<b>Limitations", "<b>Note", "undocumented: Piezo.Model"),
    ("connect(network.y, y)", "connect(network.y, y);\n  connect(y, network.y)", "connected_twice: Piezo.Model"),
    ("modelica://HystFMU.", "modelica://HystFMU.No.", "dead_link: Piezo.Model"),
    ("within Piezo;", "within Other;", "Model.mo is within Other"),
])  # fmt: skip
def test_a_mistake_in_an_exported_package_is_found(old: str, new: str, says: str, tmp_path: Path) -> None:
    package = export_modelica(MADE["nfir_without_auxiliary"](), tmp_path, "Piezo")
    assert exported.complaints(package) == []
    file = package / "Model.mo"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))
    assert says in "\n".join(exported.complaints(package))


def test_record_has_all_bits_and_the_names_of_the_fmu() -> None:
    rng = np.random.default_rng(1)
    values = np.concatenate([rng.normal(size=20) * 10.0 ** rng.integers(-300, 300, 20), [5e-324, -0.0, 0.1 + 0.2]])
    assert [float(number(v)) for v in values] == values.tolist()
    model = exported.small("actuator")
    text = record(model, "Values", "P", "a test")
    ports = {p.name: p for p in model.graph.ports if p.kind in ("param", "fixed")}
    found = dict(re.findall(r"parameter Real (\w+)(?:\[[\d, ]+\])? = (\S.*?) \"", text))
    assert set(found) == {n for n, p in ports.items() if not p.var.choices}
    for name, literal in found.items():
        assert tuple(float(x) for x in literal.strip("{}").split(", ")) == ports[name].start, name


@pytest.mark.parametrize("name", block_types())
def test_a_block_is_exported_as_its_class(name: str) -> None:
    kind = block_types()[name]
    choices = next((v.choices for v in kind.parameters if v.name == "shape"), ("",))
    for shape in choices:
        node = Node("b", name, {}, {"shape": shape} if shape else {})
        c = library.classes()[classes.class_of(node)]
        if name == "transfer_function":
            continue  # discretised: other parameters, compared by simulation
        given = {*classes.dims(node), *classes.values(node), *classes.choices(node)}
        given |= {"Ts"} if classes.is_sampled(node) else set()
        assert set(library.parameters(c)) - {"values", "state0"} == given
        assert classes.is_sampled(node) == ("Ts" in library.parameters(c))
