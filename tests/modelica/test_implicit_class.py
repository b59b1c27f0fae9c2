"""The implicit inverse in Modelica: example, exported models of every static form, refusals."""

from pathlib import Path

import compare_implicit
import exported
import library
import numpy as np
import pytest
import simulate
from made_graphs import MADE, chain, static_forms

from hystfmu import Graph, Input, InputError, Node, Output
from hystfmu.core.library import block_types
from hystfmu.inverse import inverse
from hystfmu.model import Model
from hystfmu.modelica import export_modelica
from hystfmu.modelica.classes import shipped_library

MODELS = {p.stem for p in (shipped_library() / "HystFMU" / "Inverse" / "Models").glob("*.mo")} - {"package"}


@pytest.mark.turn("loops in Modelica")
def test_example_follows_and_agrees_with_the_unit() -> None:
    now = simulate.run("HystFMU.Examples.ImplicitInverse").at(2e-3)
    r, u, y = (now[k] for k in ("wanted.r", "inverse.u", "hysteresis.y"))
    assert np.ptp(r) > 1.2
    assert np.abs(y - r).max() <= 1e-12
    E = library.evaluate(
        library.modifiers(library.classes()["HystFMU.Examples.ImplicitInverse"].tree.symbols["E"].class_modification)[
            "value"
        ],
        {},
    )
    limits = {"lo": -1.0, "hi": 1.0}
    model = Node("model", "preisach", {"n": 3, "depth": 8}, {"E": E, **limits})
    unit = compare_implicit.graph(Node("inverse", "implicit_inverse", {}, limits), model)
    assert np.abs(u - np.ravel(unit.run(r))).max() <= 1e-12


@pytest.mark.stress
def test_exported_static_forms_give_what_predict_gives(tmp_path: Path) -> None:
    model = static_forms()
    tried = {n.block.class_name for n in model.graph.nodes} - {"ImplicitInverse", "Delay"}
    assert tried == MODELS
    package = export_modelica(model, tmp_path, "Forms", "a test")
    assert exported.complaints(package) == []
    # eight times the frequency of the example, an eighth of its rows: the inverse tries 15 blocks a dozen times in each
    example = package / "Example.mo"
    text = example.read_text()
    for old, new in (("frequency = 1.0", "frequency = 8.0"), ("StopTime = 4.005", "StopTime = 0.505")):
        assert text.count(old) == 1
        text = text.replace(old, new)
    example.write_text(text)
    rows = exported.simulated(package)
    u, y = rows["tested.u"], rows["tested.y"]
    assert len(u) == 50
    assert np.ptp(y) > 1
    error = np.abs(y - model.predict(u)).max()
    print(f"{error:.1e}")
    assert error <= 1e-12


def test_every_static_operator_has_a_static_form() -> None:
    """One that is added to the core needs a file in Inverse/Models, else its implicit inverse has no Modelica form."""
    blocks = [Node("b", name).block for name in block_types()]
    operators = {b.class_name for b in blocks if b.family == "operators" and b.rate == "hysteretic"}
    assert len(operators) > 10
    assert operators <= MODELS


@pytest.mark.stress
def test_what_the_inverse_alone_needs_stands_in_its_package_alone(tmp_path: Path) -> None:
    block = (export_modelica(static_forms(), tmp_path, "Forms", "a test") / "Model.mo").read_text()
    assert "HystFMU.Dynamics.Delay" in block
    assert "HystFMU.Operators" not in block
    block = (export_modelica(MADE["implicit_inverse_in_use"](), tmp_path, "Used", "a test") / "Model.mo").read_text()
    assert "HystFMU.Operators.Sampled.BacklashSum plays(" in block
    assert "inverse.h" not in block


@pytest.mark.stress
@pytest.mark.parametrize("key", ["play_bank_mlp", "zhao_tan_mlp", "prandtl_ishlinskii", "duhem"])
def test_implicit_inverse_of_an_identified_model_gives_what_predict_gives(key: str, tmp_path: Path) -> None:
    made = inverse(exported.small(key), "implicit")
    o = exported.compare(made, f"{key}_inverse", tmp_path)
    print(exported.line(o))
    assert o.error <= o.bound


def unlike(node: Node, *more: Node) -> Model:
    nodes = [Node("inverse", "implicit_inverse"), node, *more]
    ends = [f"{node.name}.{node.block.of(k)[0].name}" for k in ("input", "output")]
    wires = [("inverse.u", ends[0]), (ends[1], "inverse.h")]
    return Model(
        "made", Graph(nodes, wires, [Input("u", ("inverse.y",))], [Output("y", "inverse.u")], sort=False), 0.01
    )


@pytest.mark.parametrize(("make", "message"), [
    (lambda: chain(Node("p", "implicit_inverse")),
     "'p': its input h must be wired to a block that depends on its output u"),
    (lambda: unlike(Node("i", "zhao_tan_inverse")), "'i': .* no static form of 'zhao_tan_inverse'"),
    (lambda: unlike(Node("g", "transfer_function")), "g: .* not have dynamics"),
])  # fmt: skip
def test_what_cannot_be_exported_is_one_line(make: object, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message) as e:
        export_modelica(make(), tmp_path / "lib", "P")  # type: ignore[operator]
    assert "\n" not in str(e.value)
    assert list(tmp_path.iterdir()) == []
