"""What a notebook shows: HTML that stands alone, is small and escapes everything; figures, by matplotlib or not."""

import re
import subprocess
import sys
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
    assert "2 of 4 draws are inside the limits" in html
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


def test_plots_do_not_import_matplotlib() -> None:
    code = "import sys, hystfmu as hy; hy.synthetic.piezo(20).plot()._repr_html_(); print('matplotlib' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == "False\n"
