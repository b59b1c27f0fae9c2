"""What a notebook shows: HTML that stands alone and escapes everything, figures, data frames, studies from Python."""

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import hystfmu as hy
from hystfmu.base.errors import InputError, MissingExtra

NASTY = "<script>alert(1)</script> & $x_1$"


@pytest.fixture(scope="module")
def data() -> hy.Dataset:
    made = hy.synthetic.piezo(30, 1000.0)
    return hy.Dataset(made.t, made.u, made.y, name=NASTY)


@pytest.fixture(scope="module")
def shown(data: hy.Dataset, tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    """One of each that a notebook may end with; names and units of measure are untrusted text."""
    pytest.importorskip("pyarrow", reason="a study needs the extra study")
    folder = tmp_path_factory.mktemp("shown")
    loop = hy.Scenario("loop", step=1e-3, stop=0.05, text=NASTY).add("source", hy.blocks.Reference(frequency=50.0))
    loop.metric("peak", "peak", "source.r", limit=2.5).record("source.r").save(folder / "loop")
    (folder / "size.study.toml").write_text(
        f'name = "size"\ntext = "{NASTY}"\nscenario = "loop"\nmethod = "grid"\n[parameters]\n'
        '"source.amplitude" = { values = [1.0, 2.0, 3.0, 4.0] }\n'
    )
    return {
        "data": data,
        "model": hy.fit(data, "prandtl_ishlinskii"),
        "result": loop.run(engine="native"),
        "results": hy.run(folder / "loop", engine="native"),
        "study": hy.study(folder / "size.study.toml", folder / "<b>out", workers=1),
    }


@pytest.mark.parametrize("name", ["data", "model", "result", "results", "study"])
def test_html_stands_alone_is_small_and_escaped(shown: dict[str, object], name: str) -> None:
    html = shown[name]._repr_html_()  # type: ignore[attr-defined]
    assert len(html) < 100_000
    assert "<script" not in html
    assert "<b>out" not in html
    assert not re.search(r"""(?:src|href)\s*=|url\(|@import""", html)
    ElementTree.fromstring(f"<div>{html}</div>")  # whole: every element that begins ends


def test_a_study_shows_its_answer(shown: dict[str, object]) -> None:
    html = shown["study"]._repr_html_()  # type: ignore[attr-defined]
    assert "2 of 4 variations are inside the limits" in html
    assert "results.parquet" in html


@pytest.mark.parametrize(("name", "x"), [("data", "u"), ("result", "t in s"), ("study", "peak")])
def test_plot_is_a_figure_that_saves(shown: dict[str, object], name: str, x: str, tmp_path: Path) -> None:
    figure = shown[name].plot()  # type: ignore[attr-defined]
    assert figure._repr_html_().startswith("<svg")
    assert x in figure.save(tmp_path / "figure.svg").read_text()
    with pytest.raises(InputError, match=r"\.html, \.svg, \.png or \.pdf\. Got '\.gif'"):
        figure.save(tmp_path / "figure.gif")


def test_the_distribution_of_a_study_is_that_of_its_rows(shown: dict[str, object]) -> None:
    (plot,) = shown["study"].plot().plots  # type: ignore[attr-defined]
    share, limit = plot.lines
    assert share.x == pytest.approx([1.0, 2.0, 3.0, 4.0], rel=1e-2)
    assert share.y.tolist() == [25.0, 50.0, 75.0, 100.0]
    assert limit.x.tolist() == [2.5, 2.5]


@pytest.mark.turn("files of commands")
def test_matplotlib_draws_the_same_rows(shown: dict[str, object], data: hy.Dataset, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="the extra notebook is not installed")
    plot = shown["model"].plot(data)  # type: ignore[attr-defined]
    figure = plot.matplotlib()
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == (plot.x_label, plot.y_label)
    for drawn, line in zip(axes.lines, plot.lines, strict=True):
        np.testing.assert_array_equal(drawn.get_xydata(), np.column_stack([line.x, line.y]))
    assert (
        data.plot().save(tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    )  # a dollar in its title is no formula
    assert shown["result"].plot().save(tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")  # type: ignore[attr-defined]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.pdf", "a.png"]


@pytest.mark.stress
def test_matplotlib_opens_no_window() -> None:
    """In a process of its own: another library may have loaded pyplot into this one."""
    pytest.importorskip("matplotlib", reason="the extra notebook is not installed")
    draw = "import sys, hystfmu as hy; hy.synthetic.piezo(20).plot().matplotlib()"
    code = f"{draw}; print('matplotlib.pyplot' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == "False\n"


def test_without_matplotlib_one_line_names_the_extra(data: hy.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtra, match=r"pip install 'hystfmu\[notebook\]'"):
        data.plot().matplotlib()
    assert data.plot()._repr_html_().startswith("<svg")


@pytest.mark.turn("imports")
def test_plots_do_not_import_matplotlib() -> None:
    code = "import sys, hystfmu as hy; hy.synthetic.piezo(20).plot()._repr_html_(); print('matplotlib' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == "False\n"


# ---- data frames -----------------------------------------------------------------------------------------------------
STEPS = 11


def loop() -> hy.Scenario:
    made = hy.Scenario("loop", step=1e-3, stop=0.01, text="a < b").add("source", hy.blocks.Reference(frequency=50.0))
    made.add("gain", hy.blocks.Scaling(gain=2.0), text="doubles").connect("source.r", "gain.u")
    return made.metric("peak", "peak", "gain.y", limit=2.5).case("small", set={"source.amplitude": 0.5}).case("large")


def test_signals_and_metrics_go_to_pandas() -> None:
    pytest.importorskip("pandas")
    results = hy.run(loop(), engine="native")
    trace = results[0].trace
    assert trace is not None
    frame = trace.to_pandas()
    assert (frame.index.name, frame.shape) == ("t [s]", (STEPS, len(trace.columns)))
    for end in trace.columns:
        np.testing.assert_array_equal(frame[end], trace[end])
    told = results.to_pandas()
    assert told[["scenario", "case", "metric", "limit", "within"]].values.tolist() == [
        ["loop", "small", "peak", 2.5, True],
        ["loop", "large", "peak", 2.5, True],
    ]
    assert told["value"].tolist() == [1.0, 2.0]


def test_a_study_from_python_is_that_of_its_file(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    study = hy.Study("size", loop(), method="grid", cases=["large"]).limits("large", {"peak": 4.5})
    study.vary("source.amplitude", values=np.arange(1.0, 4.0)).vary("gain.gain", scale=(0.5, 1.0), steps=2)
    outcome = study.run(tmp_path / "a", workers=1)
    peaks = [row["metrics"]["peak"] for row in outcome.rows]
    assert peaks == [1.0, 2.0, 2.0, 4.0, 3.0, 6.0]
    assert outcome.summary is not None
    assert outcome.summary.inside == 5
    of_file = hy.study(tmp_path / "a" / "size.study.toml", tmp_path / "b", workers=1)
    assert [row["metrics"] for row in of_file.rows] == [row["metrics"] for row in outcome.rows]
    assert study.run(tmp_path / "a", workers=1).ran == 0, "finished rows stay"
    pytest.importorskip("pandas")
    frame = outcome.to_pandas()
    assert frame["peak"].tolist() == peaks
    assert {"variation", "case", "source.amplitude", "gain.gain", "status", "reason"} < set(frame.columns)


WRONG: dict[str, tuple[Callable[[], object], str]] = {
    "name": (lambda: hy.Study("1 2", loop()), "The name must be a letter"),
    "scenario": (lambda: hy.Study("a", "no/such"), "no/such"),
    "n": (lambda: hy.Study("a", loop(), n=0), "n: The value must be greater than or equal to 1. Got 0"),
    "method": (lambda: hy.Study("a", loop(), method="optuna"), "The method must be one of random"),  # type: ignore[arg-type]
    "two ways": (lambda: hy.Study("a", loop()).vary("x.y", values=[1], range=(0, 1)), "x.y: .*must have exactly one"),
    "no range": (lambda: hy.Study("a", loop()).vary("x.y", range=(1, 0)), "a range must rise"),
    "text": (lambda: hy.Study("a", loop()).vary("x.y", values="high"), "values"),  # type: ignore[arg-type]
    "nothing": (lambda: hy.Study("a", loop()).save("a"), "parameters: The key is required"),
    "no case": (
        lambda: hy.Study("a", loop(), cases=["x"]).vary("source.amplitude", values=[1]).run("a"),
        "no case 'x'",
    ),
    "no unit": (lambda: hy.Study("a", loop()).vary("x.y", values=[1]).run("a"), "x.y"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_study_is_one_line(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    call, words = WRONG[name]
    with pytest.raises(hy.InputError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_without_pandas_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    results = hy.run(loop(), engine="native", case="small")
    trace = results[0].trace
    assert trace is not None
    monkeypatch.setitem(sys.modules, "pandas", None)
    for call in (trace.to_pandas, results.to_pandas):
        with pytest.raises(
            hy.InputError, match=re.escape("to_pandas() needs pandas, which is not installed: pip inst")
        ):
            call()


def test_a_notebook_shows_a_scenario() -> None:
    shown = loop()._repr_html_()
    assert "a &lt; b" in shown
    for cell in ("source", "reference", "gain.u", "source.r", "doubles", "peak", "2.5", "small", "large"):
        assert f">{cell}</td>" in shown, cell
    assert "step 0.001 s, 0.01 s" in shown
    assert "<table" not in hy.Scenario("empty", step=1.0)._repr_html_()
