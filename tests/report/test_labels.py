"""Labels lie apart and inside their pictures: canvases of the explorer and pictures of the docs; on paper, too.

`accessibility.js` measures the same on every kind of page.
"""

import json
from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from opened_page import Browser, Page, opened

from hystfmu import report
from hystfmu.report.axis import axis, thin, tick
from hystfmu.report.page import figure_of, percent
from hystfmu.report.plot import Line, Plot

DOCS = Path(__file__).parents[2] / "python" / "docs"
CHECKS = Path(__file__).with_name("accessibility.js").read_text()
WIDTHS = (1280, 400)
WRITTEN = """() => {  // boxes of the texts of every canvas, as they are drawn
  window.written = [];
  const paint = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
    const m = this.measureText(text);
    const box = [x - m.actualBoundingBoxLeft, y - m.actualBoundingBoxAscent, x + m.actualBoundingBoxRight,
      y + m.actualBoundingBoxDescent];
    if (text) written.push([this.canvas.className, text, box, [this.canvas.clientWidth, this.canvas.clientHeight]]);
    paint.call(this, text, x, y);
  };
}"""
PIXELS = "() => [...document.querySelectorAll('canvas')].map(c => c.toDataURL())"


SIZES = """[...document.querySelectorAll('text')].map(e => {
  const m = e.getScreenCTM();
  return Math.hypot(m.a, m.b) * parseFloat(getComputedStyle(e).fontSize);
})"""
LEAST = {1280: 9, 400: 8}  # px, of letters in pictures of the docs


def collisions(written: list[Any]) -> list[str]:
    """What lies on another text of the same canvas, or reaches out of it."""
    found = []
    for name, text, (left, top, right, bottom), (wide, high) in written:
        if min(left, top) < 0 or right > wide or bottom > high:
            found.append(f"{name}: {text} leaves the canvas")
    for (a, first, p, _), (b, second, q, _) in combinations(written, 2):
        if a == b and min(p[2], q[2]) > max(p[0], q[0]) and min(p[3], q[3]) > max(p[1], q[1]):
            found.append(f"{a}: {first} lies on {second}")
    return found


def drawn_at(p: Page, width: int) -> list[Any]:
    """The texts of the last drawing of every canvas in a window of this width."""
    p.set_viewport_size({"width": width, "height": 900})
    p.wait_for_timeout(100)
    p.evaluate("written.length = 0")
    p.get_by_role("button", name="Restart").click()
    p.wait_for_timeout(100)
    written: list[Any] = p.evaluate("written")
    return list({str(w): w for w in written}.values())


@pytest.mark.turn("pages in a browser")
@pytest.mark.some(1)
@pytest.mark.parametrize("kind", [pytest.param("demonstration", marks=pytest.mark.stress), "run", "fmu"])
def test_labels_of_the_explorer_lie_apart(browser: Browser, made: Callable[[str], Path], kind: str) -> None:
    with opened(browser, made(kind)) as p:
        p.evaluate(WRITTEN)
        found = {width: drawn_at(p, width) for width in WIDTHS}
    assert min(map(len, found.values())) > 20
    assert {width: collisions(w) for width, w in found.items()} == {width: [] for width in WIDTHS}


def test_collisions_are_found() -> None:
    page = [["loop", "a", [0, 0, 10, 10], [50, 50]], ["loop", "b", [5, 5, 15, 15], [50, 50]]]
    assert collisions(page) == ["loop: a lies on b"]
    assert collisions([["loop", "a", [45, 0, 55, 10], [50, 50]]]) == ["loop: a leaves the canvas"]


@pytest.mark.stress
def test_labels_of_a_log_axis_are_decades(browser: Browser, tmp_path: Path) -> None:
    from hystfmu.report.page import figure, page

    plots = [
        Plot("many", "f (Hz)", "dB", [Line("g", [1e-3, 2e4], [0.0, 1.0])], log_x=True),  # type: ignore[list-item]
        Plot("few", "f (Hz)", "dB", [Line("g", [3.0, 80.0], [0.0, 1.0])], log_x=True),  # type: ignore[list-item]
        Plot("long", "u", "y", [Line("g", [100000.0005, 100000.0035], [0.0, 1.0])]),  # type: ignore[list-item]
    ]
    file = tmp_path / "page.html"
    file.write_text(page("axes", ["<h1>axes</h1>", *map(figure, plots)]))
    with opened(browser, file) as p:
        for width in WIDTHS:
            p.set_viewport_size({"width": width, "height": 900})
            assert [w for w in p.evaluate(CHECKS) if "lies on" in w or "outside" in w] == []
        first = [p.locator("svg").nth(k).locator(".axes text[text-anchor=middle]").all_text_contents() for k in (0, 1)]
        assert first == [["0.001", "0.01", "0.1", "1", "10", "100", "1000", "10000"], ["5", "10", "20", "50"]]
        p.locator("svg").nth(1).focus()
        for key in "++0":
            p.keyboard.press(key)
        again = p.locator("svg").nth(1).locator(".axes text[text-anchor=middle]").all_text_contents()
        assert again == first[1]  # the page draws what Python drew
        p.locator("svg").nth(1).hover()
        assert "f (Hz) " in (p.locator("figcaption").nth(1).text_content() or "")


@pytest.mark.stress
def test_paper_has_light_colours(browser: Browser, made: Callable[[str], Path]) -> None:
    same = f"pixels => JSON.stringify(({PIXELS})()) === pixels"
    with opened(browser, made("fmu"), color_scheme="light") as p:
        p.wait_for_timeout(200)
        light = json.dumps(p.evaluate(PIXELS), separators=(",", ":"))
        p.emulate_media(color_scheme="dark")
        p.wait_for_function(f"pixels => !({same})(pixels)", arg=light)
        for scheme in ("dark", "light"):
            p.emulate_media(color_scheme=scheme, media="print")  # type: ignore[arg-type]
            p.wait_for_function(same, arg=light)


@pytest.mark.stress
def test_labels_of_the_pictures_of_the_docs_lie_apart(browser: Browser, tmp_path: Path) -> None:
    import sys

    sys.path.insert(0, str(DOCS))
    from pictures import PICTURES

    files = [DOCS / "first_screen.svg"]
    for name, (_, _, draw) in PICTURES.items():
        for k, svg in enumerate(draw()):
            files.append(tmp_path / f"{name}_{k}.svg")
            files[-1].write_text(svg)
    found = {}
    page = browser.new_page()
    for file in files:
        page.set_content(f"<!doctype html><body>{file.read_text()}")
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 900})
            wrong = [w for w in page.evaluate(CHECKS) if "lies on" in w or "outside" in w]
            least = min(page.evaluate(SIZES))
            found[f"{file.name} at {width}"] = wrong + [f"letters of {least:.1f} px"] * (least < LEAST[width])
    page.close()
    assert found == {name: [] for name in found}


# ---- Figures of a page: three digits, and no error below the floor is a figure
@pytest.mark.parametrize(
    ("value", "text"),
    [(5.58e-17, "< 0.001"), (0.0, "< 0.001"), (0.00099, "< 0.001"), (0.001, "0.001"), (12.345, "12.3"), (-2.0, "-2")],
)
def test_percent(value: float, text: str) -> None:
    assert percent(value) == text


def test_the_floor_is_that_of_percents() -> None:
    assert figure_of(1e-6, "rms_percent") == "< 0.001"
    assert figure_of(1e-6, "rms") == "1e-06"


# ---- Numbers beside an axis: short, exact, the same in a page as in Python

COMMON = (Path(report.__file__).parent / "script" / "common.js").read_text()


@pytest.mark.parametrize(("value", "text"), [
    (0.0, "0"), (0.1 + 0.2, "0.3"), (-0.005, "-0.005"), (115000.0, "115000"), (120000.0, "1.2e5"), (1e6, "1e6"),
    (2e-8, "2e-8"), (-5e299, "-5e299"), (100000.0005, "100000.0005"), (5e-301, "5e-301"),
])  # fmt: skip
def test_a_number_beside_an_axis(value: float, text: str) -> None:
    assert tick(value) == text


def test_ticks_are_round_inside_the_range_and_told_apart() -> None:
    rng = np.random.default_rng()
    for _ in range(200):
        lo = rng.normal() * 10.0 ** rng.integers(-12, 12)
        values = lo + np.array([0.0, abs(lo) * 10.0 ** rng.uniform(-6, 3) + 1e-12])
        (first, last), at = axis(values)
        assert first < values[0] < values[1] < last
        assert all(first <= v <= last for v in at)
        assert 2 <= len(at) <= 7
        assert len({tick(v) for v in at}) == len(at)
        assert [float(tick(v)) for v in at] == pytest.approx(at, rel=1e-11, abs=1e-9 * (last - first))


def test_a_page_writes_the_same_numbers(browser: Browser) -> None:
    rng = np.random.default_rng()
    spans = [sorted((rng.normal(size=2) * 10.0 ** rng.integers(-9, 9)).tolist()) for _ in range(100)]
    values = [float(f"{v:.12g}") for s in spans for v in axis(np.array(s))[1]]
    values += [5e299, -1e-300, 100000.0005, 115000.0, 1e6, 1e21, 2e-8, 0.0]
    page = browser.new_page()
    program = "([code, values]) => new Function(code + 'return a => a.map(tick);')()(values)"
    found = page.evaluate(program, [COMMON, values])
    page.close()
    assert found == [tick(v) for v in values]


def test_a_thinned_curve_keeps_its_ends_or_its_extremes() -> None:
    x = np.arange(10_000.0)
    y = np.zeros(10_000)
    y[[1234, 7890]] = 1.0, -2.0
    few = thin(x, y, 100)
    assert (len(few[0]), few[0][0], few[0][-1]) == (100, 0.0, 9999.0)
    kept = thin(x, y, 100, envelope=True)
    assert {(1234.0, 1.0), (7890.0, -2.0)} <= set(zip(*(v.tolist() for v in kept), strict=True))
    assert np.all(np.diff(kept[0]) >= 0)
    assert thin(x[:50], y[:50], 100)[0].tolist() == x[:50].tolist()
