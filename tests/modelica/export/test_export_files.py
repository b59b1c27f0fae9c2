"""`hystfmu export --modelica`: files, names, refusals; foreign files stay, writes are atomic."""

import os
import re
from pathlib import Path

import exported
import library
import pytest
from invoked import invoked
from made_graphs import MADE, chain, large_network

from hystfmu import Graph, Input, InputError, Node, Output, __version__
from hystfmu.model import Model
from hystfmu.modelica import export_modelica
from hystfmu.modelica.literals import string
from hystfmu.modelica.package import package_name

MODELS = library.ROOT.parents[1] / "scenarios" / "models"


def test_package_has_its_form(tmp_path: Path) -> None:
    model = exported.small("prandtl_ishlinskii")
    path = MODELS.parent / "nothing.model.toml"
    package = export_modelica(model, tmp_path / "new" / "lib", "Piezo", path.name)
    listed = (package / "package.order").read_text().split()
    assert sorted(f.name for f in package.iterdir()) == sorted(
        [*(f"{c}.mo" for c in listed), "package.mo", "package.order"]
    )
    for file in package.glob("*.mo"):
        first, second = file.read_text().splitlines()[:2]
        assert first == "// generated from nothing.model.toml by hystfmu export --modelica - do not edit"
        assert second == ("within Piezo;" if file.stem != "package" else second)
    about = (package / "package.mo").read_text()
    assert f'uses(HystFMU(version = "{__version__}"))' in about
    assert f'version = "{__version__}"' in library.text(library.ROOT / "package.mo")
    for told in (
        f"{model.fit['rms_percent']:.6g}",
        "RMS error, % of the span of y",
        "bent play",
        model.provenance["sha256"],
    ):
        assert told in about
    assert "version = " in about.replace("HystFMU(version", "")


def test_command_writes_the_package_and_says_so(tmp_path: Path) -> None:
    path = MODELS / "backlash_zhao_tan_inverse.model.toml"
    done = invoked(["export", str(path), "--modelica", str(tmp_path)])
    assert "BacklashZhaoTanInverse.Model" in done.output
    done = invoked(["export", str(path), "--modelica", str(tmp_path), "--name", "Other"])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["BacklashZhaoTanInverse", "Other"]


def test_same_model_gives_the_same_bytes_and_replaces_what_an_export_wrote(tmp_path: Path) -> None:
    network = large_network()
    first = export_modelica(network, tmp_path, "Piezo")
    assert {"TsOutput.mo", "TsNetwork.mo"} <= {f.name for f in first.iterdir()}
    before = {f.name: f.read_bytes() for f in first.iterdir()}
    export_modelica(network, tmp_path, "Piezo")
    assert {f.name: f.read_bytes() for f in first.iterdir()} == before
    export_modelica(MADE["dynamics"](), tmp_path, "Piezo")  # without the classes of the network
    assert sorted(f.name for f in first.iterdir()) == sorted(
        [f"{c}.mo" for c in ("Values", "Ports", "Model", "Events", "Smooth", "Example", "package")] + ["package.order"]
    )
    assert [p.name for p in tmp_path.iterdir()] == ["Piezo"]


@pytest.mark.parametrize("foreign", ["Mine.mo", "notes.txt", "Resources/", "Model.mo"])
def test_folder_with_files_of_others_is_left_alone(foreign: str, tmp_path: Path) -> None:
    package = export_modelica(MADE["dynamics"](), tmp_path, "Piezo")
    if foreign.endswith("/"):
        (package / foreign).mkdir()
    else:
        (package / foreign).write_text("within Piezo; // edited by hand\n")
    before = sorted(package.iterdir())
    with pytest.raises(InputError, match=f"{foreign.rstrip('/')}: an export replaces the folder, but did not write"):
        export_modelica(large_network(), tmp_path, "Piezo")
    assert sorted(package.iterdir()) == before
    assert [p.name for p in tmp_path.iterdir()] == ["Piezo"]


def test_a_file_in_the_place_of_the_package_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "Piezo").write_text("mine")
    with pytest.raises(InputError, match="no export wrote this folder"):
        export_modelica(MADE["dynamics"](), tmp_path, "Piezo")
    assert (tmp_path / "Piezo").read_text() == "mine"


def test_nothing_half_written_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = export_modelica(MADE["dynamics"](), tmp_path, "Piezo")
    before = {f.name: f.read_bytes() for f in package.iterdir()}
    calls = 0

    def full(self: Path, *args: object, **kwargs: object) -> int:
        nonlocal calls
        calls += 1
        if calls == 3:
            raise OSError(28, "No space left on device")
        return len(os.fspath(self))

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(InputError, match="Piezo: cannot be written: No space left"):
        export_modelica(large_network(), tmp_path, "Piezo")
    assert {f.name: f.read_bytes() for f in package.iterdir()} == before
    assert [p.name for p in tmp_path.iterdir()] == ["Piezo"]


def test_a_failed_exchange_brings_the_old_package_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = export_modelica(MADE["dynamics"](), tmp_path, "Piezo")
    before = {f.name: f.read_bytes() for f in package.iterdir()}
    rename = os.rename

    def fails(a: Path, b: Path) -> None:
        if Path(a).name == "new":
            raise OSError(13, "Permission denied")
        rename(a, b)

    monkeypatch.setattr(os, "rename", fails)
    with pytest.raises(InputError, match="Permission denied"):
        export_modelica(large_network(), tmp_path, "Piezo")
    assert {f.name: f.read_bytes() for f in package.iterdir()} == before


LOOP = Graph(
    [Node("late", "delay"), Node("total", "sum")],
    [("total.y", "late.u"), ("late.y", "total.u[2]")],
    [Input("u", ("total.u[1]",))],
    [Output("y", "total.y")],
)


@pytest.mark.parametrize(("make", "name", "message"), [
    (lambda: chain(Node("net", "polynomial_narx", {"q": 4, "n_f": 0})), "P", "'net': .* degree q up to 3; got 4"),
    (lambda: Model("made", LOOP, 0.01), "P", "total.y -> late.u leads back to an earlier block"),
    (lambda: chain(Node("d", "delay")), "my model", "'my model' must be a letter followed by"),
    (lambda: chain(Node("d", "delay")), "model", "'model' must be a letter followed by|must begin with a capital"),
    (lambda: chain(Node("d", "delay")), "HystFMU", "'HystFMU' must begin with a capital and hide no class"),
])  # fmt: skip
def test_what_cannot_be_exported_is_one_line(make: object, name: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message) as e:
        export_modelica(make(), tmp_path / "lib", name)  # type: ignore[operator]
    assert "\n" not in str(e.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["Stage_actuator", "A1__b", "X_"])
def test_a_capital_and_any_letters_make_a_package(name: str, tmp_path: Path) -> None:
    package = export_modelica(chain(Node("d", "delay")), tmp_path, name)
    assert f"package {name} " in (package / "package.mo").read_text()


def test_command_names_the_file_and_the_block(tmp_path: Path) -> None:
    path = tmp_path / "x.model.toml"
    chain(Node("p", "implicit_inverse")).save(path)
    done = invoked(["export", str(path), "--modelica", str(tmp_path / "lib")], status=2)
    assert f"{path}: block 'p': its input h must be wired to a block that depends on its output u" in done.output
    assert not (tmp_path / "lib").exists()
    done = invoked(["export", str(path)], status=2)
    assert "-o X.fmu, --modelica DIR, or both" in done.output


def test_names_and_texts_are_legal() -> None:
    assert package_name("backlash_identified") == "BacklashIdentified"
    assert package_name("2024-03 piezo, run #4") == "Model202403PiezoRun4"
    assert package_name("real") == "Real_"
    assert package_name("hystFMU") == "HystFMU_"
    assert package_name("model") == "Model_"
    assert string('a "b" \\ \n c') == '"a \\"b\\" \\\\ c"'


@pytest.mark.parametrize("second", ["du", "u_unit", "u_rate", "plays", "plays_rate", "HystFMU"])
def test_names_that_a_block_declares_differ(second: str, tmp_path: Path) -> None:
    """A port may have the name of the rate or the unit of another one, or of the rate of a component."""
    plays = Node("plays", "backlash_sum", {}, {"w0": 0.3, "r": [0.1, 0.2], "w": [0.3, 0.2]})
    whole = Node("whole", "sum", {"n": 2}, {"k": [1.0, 1.0]})
    inputs = [Input("u", ("plays.u",), "V"), Input(second, ("whole.u[2]",), "V")]
    graph = Graph([plays, whole], [("plays.y", "whole.u[1]")], inputs, [Output("y", "whole.y", "um")])
    package = export_modelica(Model("m", graph, 1e-3), tmp_path, "Pkg")
    declared = re.compile(r"^  (?:parameter |constant )?(?:HystFMU\.[\w.]+|Real|Boolean|Values) (\w+)", re.M)
    ports, events = (declared.findall((package / f"{name}.mo").read_text()) for name in ("Ports", "Events"))
    assert {"u", "du", "u_unit", "y"} <= set(ports)
    assert {"plays_rate", "plays__rate"} & set(events)
    assert len({*ports, *events}) == len(ports + events)
    assert "HystFMU" not in ports
