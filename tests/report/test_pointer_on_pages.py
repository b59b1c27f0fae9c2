"""Real pointer and keys on the pages of runs, studies, comparisons and FMUs: matrix, draws, overlaid signals."""

import json
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from opened_page import SCENARIOS, Browser, Locator, Page, data, dragged, opened

import hystfmu as hy
from hystfmu.scenario import Cases
from hystfmu.scenario.system.system import build

NUMBER = re.compile(r"-?\d+\.?\d*(?:e[+-]?\d+)?")


@pytest.fixture
def run(made: Callable[[str], Path]) -> Path:
    return made("run")


@pytest.fixture
def study(made: Callable[[str], Path]) -> Path:
    return made("study")


def numbers(text: str | None) -> list[float]:
    return [float(v) for v in NUMBER.findall(text or "")]


def over(p: Page, plot: Locator, x: float, y: float = 0.5) -> None:
    """Move the pointer to shares of the frame of a plot, from its lower left corner."""
    plot.scroll_into_view_if_needed()
    box = plot.locator(".frame").first.bounding_box()
    assert box is not None
    p.mouse.move(box["x"] + x * box["width"], box["y"] + (1 - y) * box["height"])


@pytest.mark.turn("pages in a browser")
def test_the_matrix_sorts_by_a_scenario_and_says_what_the_data_say(browser: Browser, run: Path) -> None:
    told = json.loads((run.parent / "report.json").read_text())["results"]
    of_pid = {r["case"]: r["metrics"][0]["value"] for r in told if r["scenario"] == "pid"}
    with opened(browser, run) as p:
        matrix = p.locator("table.matrix").first
        p.get_by_text("Scenarios against cases").click()
        matrix.get_by_role("button", name="pid").click()
        rows = [[c.strip() for c in r.locator("th, td").all_text_contents()] for r in matrix.locator("tr").all()[1:]]
        column = matrix.locator("tr").first.locator("th").all_text_contents().index("pid")
        shown = {r[0]: numbers(r[column])[0] for r in rows if r[column]}
        assert shown == {case: pytest.approx(v, rel=0.01) for case, v in of_pid.items()}
        assert list(shown) == sorted(of_pid, key=of_pid.__getitem__)
        assert all(r[column].endswith("ok") for r in rows if r[column])


@pytest.mark.stress
def test_a_cell_leads_to_its_case_by_pointer_and_key(browser: Browser, run: Path) -> None:
    with opened(browser, run) as p:
        fold = p.locator("details", has=p.locator('[id="sliding_mode/sine_100"]'))
        assert fold.get_attribute("open") is None
        p.get_by_text("Scenarios against cases").click()
        p.locator('a[href="#sliding_mode/sine_100"]').click()
        assert fold.get_attribute("open") is not None
        assert fold.locator("figure").first.is_visible()
        link = p.locator('a[href="#pid/sine_10"]').first
        link.focus()
        p.keyboard.press("Enter")
        assert p.locator('[id="pid/sine_10"] figure').first.is_visible()


@pytest.mark.stress
def test_wanted_reached_and_error_share_a_cursor(browser: Browser, run: Path) -> None:
    with opened(browser, run) as p:
        worst = p.locator(".hero > div").first
        over(p, worst.locator("svg").first, 0.4)
        t, wanted, reached = numbers(worst.locator("output").nth(0).text_content())
        at, error = numbers(worst.locator("output").nth(1).text_content())
        assert at == pytest.approx(t, rel=1e-3)
        assert abs(wanted) <= 1.1
        assert abs(reached - wanted) < 0.2
        assert abs(error) < 5  # % of the stroke


@pytest.mark.stress
def test_a_page_of_400_px_scrolls_the_matrix_alone(browser: Browser, run: Path) -> None:
    with opened(browser, run, viewport={"width": 400, "height": 800}, color_scheme="dark") as p:
        assert p.evaluate("document.documentElement.scrollWidth") <= 400
        wide = p.locator(".wide", has=p.locator("table.matrix")).first
        name = wide.locator("th[scope=row]").first
        before = name.bounding_box()
        wide.evaluate("e => e.scrollLeft = 120")
        after = name.bounding_box()
        assert wide.evaluate("e => e.scrollLeft") > 50
        assert before is not None
        assert after is not None
        assert after["x"] == pytest.approx(before["x"], abs=1)  # the names of the cases stay


def draws(study: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Amplitude, factor, and whether the closed form of the lag is inside the limits."""
    table = pytest.importorskip("pyarrow.parquet").read_table(study.parent / "results.parquet").to_pylist()
    rows = [r for r in table if r["case"] == "one"]
    step, b = (np.array([r[k] for r in rows]) for k in ("command.step", "lag.b"))
    one, half = (step * b * (1 - math.exp(-t / 0.5)) for t in (1.0, 0.5))
    return step, b, (one <= 3.0) & (half <= 2.5) & (step <= 3.5)


@pytest.mark.turn("pages in a browser")
def test_a_range_of_an_axis_chooses_draws(browser: Browser, study: Path) -> None:
    step, _, good = draws(study)
    with opened(browser, study) as p:
        assert f"{good.sum()} of {len(good)} variations" in p.locator(".answer").text_content()
        axes = p.locator("svg.parallel .axis")
        names = [axes.nth(k).get_attribute("data-name") for k in range(axes.count())]
        axis = axes.nth(names.index("command.step"))
        field, said = axis.locator(".field"), p.locator("figure", has=p.locator("svg.parallel")).locator("output")
        field.scroll_into_view_if_needed()
        box = field.bounding_box()
        assert box is not None
        y = box["y"] + box["height"] / 2
        p.mouse.move(box["x"] + 0.25 * box["width"], y)
        p.mouse.down()
        p.mouse.move(box["x"] + 0.75 * box["width"], y, steps=4)
        p.mouse.up()
        share = (step - step.min()) / np.ptp(step)
        chosen = np.abs(share - 0.5) <= 0.25
        assert numbers(said.text_content())[:2] == pytest.approx([(good & chosen).sum(), chosen.sum()], abs=1)
        assert p.locator(".draw.off").count() == pytest.approx((~chosen).sum(), abs=1)
        field.focus()
        p.keyboard.press("Escape")
        assert said.text_content() == ""
        p.keyboard.press("ArrowRight")
        lower = share <= 1 / 3
        assert numbers(said.text_content())[:2] == pytest.approx([(good & lower).sum(), lower.sum()], abs=1)
        assert float(field.get_attribute("aria-valuenow")) == pytest.approx(step.min() + np.ptp(step) / 6, rel=0.01)


@pytest.mark.stress
def test_a_dot_of_a_scatter_names_its_draw(browser: Browser, study: Path) -> None:
    step, b, _ = draws(study)
    last = step * b * (1 - math.exp(-2))
    with opened(browser, study) as p:
        figure = p.locator("figure", has=p.locator("svg .dots")).first
        against = {"command.step": step, "lag.b as a factor": b}
        (x,) = (v for k, v in against.items() if k in (figure.locator("figcaption").text_content() or ""))
        over(p, figure.locator("svg"), 0.5, 0.4)
        found = numbers((figure.locator("output").text_content() or "").partition(":")[2])
        assert min(np.hypot(x - found[0], last - found[1])) < 0.02


@pytest.mark.turn("pages in a browser")
def test_two_runs_are_read_at_once(browser: Browser, made: Callable[[str], Path]) -> None:
    with opened(browser, made("compare")) as p:
        over(p, p.locator(".hero svg").first, 0.3)
        t, old, new = numbers(p.locator(".hero output").nth(0).text_content())
        at, difference = numbers(p.locator(".hero output").nth(1).text_content())
        assert at == pytest.approx(t, rel=1e-3)
        assert difference == pytest.approx(new - old, abs=0.02)
        changes = [abs(float(v)) for v in p.locator(".hero td:nth-child(5)").all_text_contents()]
        assert changes == sorted(changes, reverse=True)
        assert changes[0] > 1
        p.locator(".hero").get_by_role("button", name="change in %").click()
        signed = [float(v) for v in p.locator(".hero td:nth-child(5)").all_text_contents()]
        assert signed == sorted(signed)


@pytest.mark.stress
def test_the_plant_of_a_loop_runs_behind_its_inverse(browser: Browser, run: Path) -> None:
    case = next(c for c in Cases(SCENARIOS / "pid").cases if c.name == "sine_10")
    units = {p.name: p.own for p in build(case).parts}
    with opened(browser, run) as p:
        assert float(p.locator("canvas.loop").get_attribute("aria-valuemax")) == pytest.approx(0.98, abs=0.01)
        p.get_by_label("in front").select_option(label="inverse of plant")
        found = dragged(p)
    assert np.ptp(found["wanted"]) > 0.5
    assert found["u"].tolist() == units["inverse"].run(found["wanted"], case.step).ravel().tolist()  # bit for bit
    inputs = np.column_stack([found["u"], np.zeros(len(found["u"]))])
    assert found["plant"].tolist() == units["plant"].run(inputs, case.step).ravel().tolist()


@pytest.mark.stress
def test_the_model_of_an_fmu_runs_in_its_documentation(browser: Browser, made: Callable[[str], Path]) -> None:
    model = hy.fit(data(), "prandtl_ishlinskii", N=20)
    with opened(browser, made("fmu")) as p:
        found = dragged(p)
    assert len(found["u"]) > 200
    assert found["prandtl_ishlinskii"].tolist() == model.predict(found["u"]).tolist()  # bit for bit
