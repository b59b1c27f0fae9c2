"""Pages from files, with a count of what they request, and a drag in their explorer."""

import csv
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from click.testing import CliRunner
from decay import LAG

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.demo import demo
from hystfmu.report.plot import Line, Plot
from papers.table import Report, Row

try:
    from playwright.sync_api import Browser, Locator, Page
except ImportError:  # the fixture `browser` skips the tests
    Browser = Locator = Page = Any  # type: ignore[assignment,misc]


@contextmanager
def opened(browser: Browser, file: Path, waits: bool = True, **options: Any) -> Iterator[Page]:
    """A page in a window, with its explorer started; it may print nothing and request nothing but its own file."""
    context = browser.new_context(**{"viewport": {"width": 1100, "height": 900}, "accept_downloads": True, **options})
    page = context.new_page()
    asked: list[str] = []
    told: list[str] = []
    page.on("request", lambda r: asked.append(r.url))
    page.on("console", lambda m: told.append(m.text))
    page.on("pageerror", lambda e: told.append(str(e)))
    page.route(lambda url: not url.startswith("file:"), lambda route: route.abort())
    page.goto(file.as_uri())
    if waits and page.locator(".explorer").count():
        page.locator(".status:not(:empty)").wait_for()
    yield page
    outside = [url for url in asked if url != file.as_uri() and not url.startswith("blob:")]
    context.close()
    assert outside == []
    assert told == []


def dragged(p: Page) -> dict[str, np.ndarray]:
    """Drag the input of an explorer to and fro; return the columns of the file that the page saves."""
    p.locator("canvas.loop").scroll_into_view_if_needed()
    box = p.locator("canvas.loop").bounding_box()
    assert box is not None
    for k, share in enumerate([0.2, 0.9, 0.35, 0.7]):
        p.mouse.move(box["x"] + share * box["width"], box["y"] + box["height"] / 2, steps=1 if k == 0 else 5)
        if k == 0:
            p.mouse.down()
    p.mouse.up()
    with p.expect_download() as waited:
        p.get_by_role("button", name="Save the path").click()
    head, *rows = csv.reader(waited.value.path().read_text().splitlines())
    return dict(zip(head, np.array(rows, dtype=float).T, strict=True))


# ---- A page of each kind, as the commands write it, from records and loops that take seconds
SCENARIOS = Path(__file__).parents[2] / "scenarios"
CASES = ("sine_10", "sine_100", "up_400_10", "noise_10")
PLAY = {"block": "backlash_sum", "dims": {"n": 1}, "values": {"r": [0.5]}}
DECAY: dict[str, Any] = {  # a hysteretic unit behind the lag, for the explorer of the page
    **LAG,
    "order": [*LAG["order"], "play"],
    "units": {**LAG["units"], "play": PLAY},
    "connections": {**LAG["connections"], "play.u": "lag.y"},
}
DRAWS: dict[str, Any] = {
    "name": "draws",
    "scenario": "decay",
    "method": "random",
    "n": 60,
    "seed": 3,
    "limits": {"one": {"last": 3.0}, "half": {"last": 2.5, "peak": 3.5}},
    "parameters": {"command.step": {"range": [1.0, 4.0]}, "lag.b": {"scale": [0.5, 2.0]}},
}


def data() -> hy.Dataset:
    return hy.synthetic.piezo(40, 1000.0).with_train(":6000")


def fit(folder: Path) -> Path:
    return hy.fit(data(), "prandtl_ishlinskii", N=20).report(data(), folder / "fit.html")


def start(folder: Path) -> Path:
    hy.synthetic.piezo(40, 1000.0).to_csv(folder / "piezo.csv")
    words = ["start", str(folder / "piezo.csv"), "--model", "prandtl_ishlinskii", "-o", str(folder / "mine")]
    CliRunner().invoke(main, words, catch_exceptions=False)
    return folder / "mine" / "report.html"


def run(folder: Path) -> Path:
    paths = [SCENARIOS / "pid", SCENARIOS / "sliding_mode", SCENARIOS / "example_jacobi"]
    hy.run(paths, case=[*CASES, "in_parallel"], engine="native", report=folder)
    return folder / "report.html"


def failed(folder: Path) -> Path:
    """A run whose cases exceed their limits."""
    hy.run(SCENARIOS / "pid", case=CASES, engine="native", set={"pid.Kp": "*6"}, report=folder)
    return folder / "report.html"


def study(folder: Path) -> Path:
    (folder / "decay").mkdir(parents=True)
    (folder / "decay" / "scenario.toml").write_text(tomli_w.dumps(DECAY))
    (folder / "draws.study.toml").write_text(tomli_w.dumps(DRAWS))
    hy.study(folder / "draws.study.toml", folder / "out", workers=1)
    return folder / "out" / "report.html"


def compare(folder: Path) -> Path:
    for name, factor in (("a", "*1"), ("b", "*1.3")):
        (folder / name).mkdir(parents=True)
        hy.run(SCENARIOS / "pid", case=CASES, engine="native", set={"pid.Kp": factor}, report=folder / name)
    words = ["compare", str(folder / "a"), str(folder / "b"), "-o", str(folder / "diff.html")]
    CliRunner().invoke(main, words, catch_exceptions=False)
    return folder / "diff.html"


def compared_studies(folder: Path) -> Path:
    """The study of two lags, one of which is faster and has another limit."""
    for name, a, limit in (("a", 0.5, 3.0), ("b", 0.4, 2.7)):
        lag = {**LAG["units"]["lag"], "values": {"b": [1.0], "a": [a, 1.0], "hold": "zoh"}}
        (folder / name / "decay").mkdir(parents=True)
        (folder / name / "decay" / "scenario.toml").write_text(
            tomli_w.dumps({**DECAY, "units": {**DECAY["units"], "lag": lag}})
        )
        limits = {"one": {"last": limit}, "half": {"last": 2.5, "peak": 3.5}}
        (folder / name / "draws.study.toml").write_text(tomli_w.dumps({**DRAWS, "limits": limits}))
        hy.study(folder / name / "draws.study.toml", folder / name / "out", workers=1)
    words = ["compare", *(str(folder / name / "out") for name in "ab"), "-o", str(folder / "diff.html")]
    CliRunner().invoke(main, words, catch_exceptions=False)
    return folder / "diff.html"


def paper(folder: Path) -> Path:
    """The page of a paper, as `hystfmu reproduce --report` writes it, with figures made up for it."""
    t = np.linspace(0, 1, 50)
    rows = [
        Row("10 Hz, largest error, % of span", 1.34, 2.0, 0.43, place="table 1"),
        Row("100 Hz, largest error, % of span", 1.34, None, 1.9, place="table 1", note="the record is not published"),
        Row("settled share, %", 95.0, 80.0, 97.0, place="fig. 3", sense="least"),
        Row("number of parameters", 49, 49, 49, place="section 4", sense="equal"),
        Row("other plant, RMS, % of span", None, None, 0.2, 0.1, note="a plant with creep"),
    ]
    drawing = Plot("fig. 3: validation", "t (s)", "y", [Line("ours", t, np.sin(9 * t))])
    found = Report("paper_2008", "A. Author, Journal of Pages 1 (2008) 1-10", tuple(rows), ("a note",), (drawing,))
    (folder / "paper.html").write_text(found.html())
    return folder / "paper.html"


def demonstration(folder: Path) -> Path:
    """The page of the demo, as it is."""
    assert demo(folder)
    return folder / "report.html"


def _documentation(folder: Path, model: hy.Model) -> Path:
    page = folder / "index.html"
    page.write_bytes(zipfile.ZipFile(model.export(folder / "m.fmu")).read("documentation/index.html"))
    return page


def fmu(folder: Path) -> Path:
    return _documentation(folder, hy.fit(data(), "prandtl_ishlinskii", N=20))


def fmu_of_a_block(folder: Path) -> Path:
    """A block states no range of its input: a picture instead of the explorer."""
    return _documentation(folder, hy.Model("creep", hy.blocks.Creep().graph))


KINDS: dict[str, Callable[[Path], Path]] = {
    f.__name__: f
    for f in (fit, start, run, failed, study, compare, compared_studies, paper, demonstration, fmu, fmu_of_a_block)
}
# pages of other kinds have the same parts
LONG = ("start", "failed", "compared_studies", "demonstration")
EACH = [pytest.param(kind, marks=[pytest.mark.stress] * (kind in LONG)) for kind in KINDS]
