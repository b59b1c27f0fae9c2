"""Pages in Chromium: hover, zoom, linked cursors, sorting, filtering; contrast, names, order of focus; no request."""

import re
from pathlib import Path

import numpy as np
import pytest
from opened_page import Browser, Locator, Page, opened

from hystfmu import report
from hystfmu.report.page import PARTS, Section, Table, page, section
from hystfmu.report.plot import Line, Plot

MOST_SCRIPT = 30_000
CHECKS = Path(__file__).with_name("accessibility.js").read_text()
T = np.linspace(0, 2, 200)
OVER = '<figure><svg><text x="9" y="20">first</text><text x="9" y="24">second</text></svg></figure>'
ROWS = [(f"run {k}", k * 7 % 12, f"{(k * 5 % 12) / 8:.3f}" if k else "-") for k in range(12)]


@pytest.mark.parametrize("part", ["", *PARTS, "".join(PARTS)])
def test_the_script_of_a_page_is_small(part: str, capsys: pytest.CaptureFixture[str]) -> None:
    script = page("parts", [part]).partition("</main><script>")[2].partition("</script>")[0]
    with capsys.disabled():
        print(f"\nscript of a page with {part or 'plots and tables'}: {len(script.encode())} bytes")
    assert 8_000 < len(script.encode()) <= MOST_SCRIPT


def test_the_lines_of_scripts_are_short() -> None:
    for f in (Path(report.__file__).parent / "script").iterdir():
        assert [line for line in f.read_text().splitlines() if len(line) > 120] == [], f.name


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    plots = [
        Plot("ramp", "time (s)", "voltage (V)", [Line("reference", T, 10 * T), Line("output", T, 10 * T - 1)]),
        Plot("square", "time (s)", "error (um)", [Line("error", T, T**2)]),
        Plot("circle", "u (V)", "y (um)", [Line("loop", np.cos(4 * T), np.sin(4 * T))]),
    ]
    path = tmp_path_factory.mktemp("pages") / "page.html"
    body = section(Section("Plots", "Three.", [Table(("name", "number", "share"), ROWS)], plots))
    path.write_text(page("plots", ["<h1>plots</h1>", body]))
    return path


def inside(plot: Locator, x: float, y: float) -> tuple[float, float]:
    """The place on the screen of shares of the frame of a plot, from its lower left corner."""
    plot.scroll_into_view_if_needed()
    box = plot.locator(".frame").bounding_box()
    assert box is not None
    return box["x"] + x * box["width"], box["y"] + (1 - y) * box["height"]


def axis(plot: Locator, name: str) -> tuple[float, float]:
    a, b = (plot.get_attribute(f"data-{name}") or "").split()
    return float(a), float(b)


def numbers(p: Page, k: int) -> list[float]:
    return [float(v) for v in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", p.locator("figure output").nth(k).text_content())]


def ticks(plot: Locator) -> list[str]:
    return plot.locator(".axes .tick").all_text_contents()


def test_hover_reads_the_curves_and_links_plots_of_the_same_time(browser: Browser, file: Path) -> None:
    with opened(browser, file) as p:
        first = p.locator("figure svg").nth(0)
        lo, hi = axis(first, "x")
        p.mouse.move(*inside(first, 0.5, 0.3))
        t, reference, output = numbers(p, 0)
        assert t == pytest.approx((lo + hi) / 2, rel=0.01)
        assert (reference, output) == pytest.approx((10 * t, 10 * t - 1), abs=0.12)
        assert numbers(p, 1) == pytest.approx([t, t**2], abs=0.02)
        assert numbers(p, 2) == []
        p.mouse.move(*inside(p.locator("figure svg").nth(2), 0.99, 0.5))
        x, y = numbers(p, 2)
        assert (x**2 + y**2, abs(y) < 0.1, numbers(p, 0)) == (pytest.approx(1, abs=0.02), True, [])


@pytest.mark.stress
def test_zoom_by_drag_wheel_and_keys_and_back(browser: Browser, file: Path) -> None:
    with opened(browser, file) as p:
        plot = p.locator("figure svg").nth(0)
        whole = ticks(plot)
        p.mouse.move(*inside(plot, 0.4, 0.4))
        p.mouse.wheel(0, -100)  # the reader scrolls past: no zoom
        assert ticks(plot) == whole
        p.mouse.move(*inside(plot, 0.4, 0.4))
        p.mouse.down()
        p.mouse.move(*inside(plot, 0.6, 0.6), steps=3)
        p.mouse.up()
        near = [float(v) for v in ticks(plot)]
        assert near != [float(v) for v in whole]
        assert max(near) < 13  # volts
        t, reference, _ = (p.mouse.move(*inside(plot, 0.5, 0.5)), numbers(p, 0))[1]
        assert reference == pytest.approx(10 * t, abs=0.12)
        assert plot.locator("path.line").nth(1).bounding_box() is not None
        p.mouse.dblclick(*inside(plot, 0.5, 0.5))
        assert ticks(plot) == whole
        p.mouse.wheel(0, -300)  # chosen by the click
        assert ticks(plot) != whole
        p.keyboard.press("Escape")
        assert ticks(plot) == whole
        p.keyboard.press("+")
        assert ticks(plot) != whole
        p.keyboard.press("0")
        p.keyboard.press("ArrowRight")
        assert numbers(p, 0)[0] == pytest.approx(T[2], abs=0.02)


def test_tables_sort_by_numbers_and_filter(browser: Browser, file: Path) -> None:
    with opened(browser, file) as p:
        cells = p.locator("tr:visible td:nth-child(3)")
        p.get_by_role("button", name="share").click()
        values = cells.all_text_contents()
        assert values[-1] == "-"
        assert values[:-1] == sorted(values[:-1], key=float)
        assert p.locator("th").nth(2).get_attribute("aria-sort") == "ascending"
        p.keyboard.press("Enter")  # the button has the focus
        assert cells.all_text_contents()[1:] == values[:-1][::-1]
        p.get_by_label("Filter rows").fill("run 1")
        assert cells.count() == 3
        assert p.locator(".filter output").text_content() == "3 of 12 rows"


@pytest.mark.turn("pages in a browser")
@pytest.mark.some(1)
@pytest.mark.parametrize("width", [1100, 800, 400])
def test_numbers_and_names_beside_a_plot_leave_each_other_room(browser: Browser, tmp_path: Path, width: int) -> None:
    values = {
        "diverged": 5e299 * T**9, "below": -5e299 * T, "tiny": 1e-300 * np.sin(T), "far": 123456.7 + T, "flat": 0 * T,
        "small": -0.00125 * T,
    }  # fmt: skip
    names = [f"a name of some length {k}" for k in range(5)]
    plots = [
        Plot(k, "t in s", "value in um", [Line("wanted", T, y), Line("reached", T, -y)]) for k, y in values.items()
    ]
    plots.append(Plot("names", "t in s", "value in " + 40 * "mm ", [Line(name, T, T) for name in names]))
    path = tmp_path / "page.html"
    path.write_text(page("plots", ["<h1>plots</h1>", section(Section("Plots", plots=plots))]))
    with opened(browser, path, viewport={"width": width, "height": 900}) as p:
        assert p.evaluate(CHECKS) == []
        for text in p.locator("figure:last-child svg text").all():
            box, around = text.bounding_box(), p.locator("figure:last-child svg").bounding_box()
            assert box is not None
            assert around is not None
            assert box["x"] + box["width"] <= around["x"] + around["width"] + 1


@pytest.mark.stress
def test_the_list_of_checks_finds_planted_faults(browser: Browser, tmp_path: Path) -> None:
    path = tmp_path / "bad.html"
    grey = '<p><font color="#999999">grey</font></p>'  # the policy of a page refuses attributes of style
    bad = f'<h1>a</h1><h3>b</h3>{grey}<button></button><input><i tabindex="3">c</i><img src="">'
    path.write_text(page("bad", [bad, "<table><tr><th>x</th></tr></table>", "<canvas></canvas>", OVER]))
    with opened(browser, path) as p:
        found = "\n".join(p.evaluate(CHECKS))
    for text in (
        "headings: 1,3",
        "contrast 2.8",
        "no name",
        "own place",
        "alternative text",
        "without scope",
        "no role",
        'lies on "second"',
    ):
        assert text in found, text
