"""Results as data frames, studies from Python, a scenario in a notebook."""

import re
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import hystfmu as hy

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
