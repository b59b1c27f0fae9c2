"""The face: its names, the methods of a model, what a person sees of it."""

import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

import hystfmu as hy

ROOMS = ("base", "core", "data", "graph", "identify", "model", "scenario")


@pytest.fixture(scope="module")
def data() -> hy.Dataset:
    return hy.synthetic.piezo(60, 1000.0)


@pytest.fixture(scope="module")
def model(data: hy.Dataset) -> hy.Model:
    return hy.fit(data, "prandtl_ishlinskii", N=20)


def run_python(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout


def test_dir_lists_the_face_and_every_name_loads():
    assert dir(hy) == sorted(hy.__all__)
    for name in hy.__all__:
        assert getattr(hy, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'fitt'"):
        hy.fitt  # noqa: B018


def test_import_loads_the_lowest_room_alone_and_help_loads_no_numpy():
    slow = ("numpy", "torch", "control", "scipy", "fmpy", "pydantic")
    loaded = f"print(sorted(m for m in sys.modules if m.startswith('hystfmu.') or m in {slow}))"
    assert run_python(f"import sys, hystfmu; {loaded}").strip() == "['hystfmu.base']"
    # the command line itself and the one exception it catches
    names = run_python(
        f"import sys\nfrom hystfmu.cli import main\ntry:\n main(['--help'])\nexcept SystemExit:\n {loaded}"
    ).splitlines()[-1]
    assert not any(f"'{m}'" in names for m in slow)
    assert "hystfmu.face" not in names


def test_a_model_of_the_face_scores_and_plots(data: hy.Dataset, model: hy.Model, tmp_path: Path):
    assert isinstance(model, hy.Model)
    assert model.score(data)["rms_percent"] == pytest.approx(model.fit["rms_percent"], rel=1e-12)
    part = model.score(data, "100:200")
    e = model.predict(data.u, data.h)[100:200] - data.y[100:200]
    assert part["max"] == np.abs(e).max()
    plot = model.plot(data)
    assert [line.name for line in plot.lines] == ["measured", "model"]
    for name in ("p.svg", "p.html"):
        assert plot.save(tmp_path / name).exists()
    ET.parse(tmp_path / "p.svg")  # a whole XML document
    assert plot._repr_html_() in (tmp_path / "p.html").read_text()
    with pytest.raises(hy.InputError, match=r"must end in \.html, \.svg, \.png or \.pdf"):
        plot.save(tmp_path / "p.jpg")
    silent = data.with_output(np.full(len(data.t), np.nan))
    assert [line.name for line in model.plot(silent).lines] == ["model"]
    with pytest.raises(hy.InputError, match="must have a measured output"):
        model.score(silent)


@pytest.mark.turn("scenarios of the face")
def test_a_fit_tells_the_error_on_the_rows_after_the_training_rows(data: hy.Dataset):
    half = data.with_train((0, len(data.t) // 2))
    made = hy.fit(half, "prandtl_ishlinskii", N=20)
    e = made.predict(data.u, data.h)[len(data.t) // 2 :] - data.y[len(data.t) // 2 :]
    assert made.fit["held_out_rms_percent"] == pytest.approx(100 * np.sqrt(np.mean(e**2)) / half.span)
    assert "held-out rows" in str(made)
    assert "held_out_rms_percent" not in hy.fit(data, "prandtl_ishlinskii", N=20).fit


@pytest.mark.turn("scenarios of the face")
def test_inverse_is_a_model_of_the_face_by_the_first_method_that_it_admits(data: hy.Dataset, model: hy.Model):
    exact = model.inverse()
    assert exact.provenance["inverse"] == "exact"
    wanted = model.predict(data.u[:500])
    assert np.abs(model.predict(exact.predict(wanted)) - wanted).max() < 1e-9 * data.span
    static = hy.fit(data, "krasnoselskii_pokrovskii")
    assert static.inverse().provenance["inverse"] != "exact"
    assert isinstance(static.inverse("implicit"), hy.Model)
    with pytest.raises(hy.InputError, match="no exact inverse"):
        static.inverse("exact")
    with pytest.raises(hy.InputError, match=r"must be named. Got 'lo'"):
        model.inverse(lo=0.0)


def test_print_is_one_screen_and_says_what_a_reader_asks(model: hy.Model):
    text = str(model)
    assert len(text.splitlines()) <= 30
    for word in ("prandtl_ishlinskii", "input", "output", "um", "hysteresis_w", "training rows", "RMS %"):
        assert word in text
    assert text.splitlines()[0] == f"{model.key}: {model.text}"
    html = model._repr_html_()
    assert "<table>" in html
    assert "hysteresis_w" in html
    warned = hy.Model(model.key, model.graph, fit={"warnings": ["the output <drifts>"]})
    assert "warning: the output <drifts>" in str(warned)
    assert "&lt;drifts&gt;" in warned._repr_html_()
    assert repr(model).startswith("Model('prandtl_ishlinskii', u -> y, 22 parameters, RMS ")


def test_columns_of_any_kind_make_a_dataset():
    pyarrow = pytest.importorskip("pyarrow")
    t, u, y = [0.0, 0.1, 0.2, 0.3], [0, 1, 2, 1], (0.0, 0.5, 1.5, 1.2)
    wanted = hy.Dataset(np.array(t), np.array(u), np.array(y))
    table = pyarrow.table({"t": t, "u": u, "y": y})
    for made in (hy.Dataset(t, u, y), hy.Dataset(table["t"], table["u"], table["y"])):
        assert made.sha256 == wanted.sha256
    for bad in (["a", 1, 2, 1], [[1], [1, 2], 2, 1], [None, {}, 2, 1]):
        with pytest.raises(hy.InputError, match=r"^data: The 'u' array must hold numbers") as e:
            hy.Dataset(t, bad, y)
        assert "\n" not in str(e.value)


def test_every_repr_is_short(model: hy.Model, data: hy.Dataset):
    loop = hy.Scenario("loop", step=1e-3, stop=0.01).add("source", hy.blocks.Reference(levels=np.arange(50.0)))
    loop.add("plant", model).connect("source.r", "plant.u").metric("largest", "peak", "plant.y", limit=1e3)
    result = loop.run(engine="native")
    node = model.graph.nodes[0]
    shown = [data, model, model.inverse(), model.graph, node, model.unit(), model.plot(data), model.plot(data).lines[0]]
    shown += [hy.blocks.Reference(levels=np.arange(50.0)), loop, loop.ready(), loop.ready().cases[0]]
    shown += [result, result.trace, result.system, result.plot(), hy.run(loop, engine="native")]
    for thing in shown:
        assert len(repr(thing)) < 200, thing
        assert " at 0x" not in repr(thing)
    assert repr(data.with_train("0:100").with_output(np.full(len(data.t), np.nan))) == (
        "Dataset('synthetic piezo stack', 12801 rows, step 0.001 s, u in V, y in um, no output, train 0:100)"
    )
    for thing in (data, data.with_output(np.full(len(data.t), np.nan)), model, result, result.plot()):
        assert thing._repr_html_().startswith("<")
