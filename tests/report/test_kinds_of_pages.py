"""Every kind of page: the answer on the first screen, the list of accessibility, its size, nothing from a network."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from opened_page import EACH, Browser, opened

import hystfmu as hy
from hystfmu import demo

CHECKS = Path(__file__).with_name("accessibility.js").read_text()
MOST_PAGE = 1_000_000
DOCS = Path(__file__).parents[2] / "python" / "docs"
EXPLORED = {"fit", "start", "run", "failed", "study", "demonstration", "fmu"}
REACHED = """() => {
  window.reached = new Set();  // heights of what had the focus
  addEventListener('focusin', e => reached.add(Math.round(e.target.getBoundingClientRect().top + scrollY)));
}"""
LOOKS = [(width, scheme) for scheme in ("light", "dark") for width in (1280, 400)]
FEWEST = {"fmu_of_a_block": 2, "paper": 2}  # heights with something for the keyboard, of the first 30
Made = Callable[[str], Path]


@pytest.mark.some(1)
@pytest.mark.parametrize("kind", EACH)
def test_every_page_is_accessible_and_answers_first(browser: Browser, made: Made, kind: str) -> None:
    with opened(browser, made(kind)) as p:
        wrong = {}
        for width, scheme in LOOKS:
            p.set_viewport_size({"width": width, "height": 900})
            p.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
            first = p.locator("figure, canvas").first.bounding_box()
            assert first is not None
            found = p.evaluate(CHECKS) + (["no figure on the first screen"] if first["y"] >= 600 else [])
            wrong |= {f"{width} px, {scheme}": found} if found else {}
        assert wrong == {}
        if kind == "fit":
            tops = {n: (p.locator(n).first.bounding_box() or {})["y"] for n in ("section", "figure", "table")}
            assert min(tops, key=tops.__getitem__) == "figure", "the loop comes first"
        assert p.locator(".explorer").count() == (kind in EXPLORED)
        p.evaluate(REACHED)
        for _ in range(30):
            p.keyboard.press("Tab")
        assert len(p.evaluate("[...reached]")) >= FEWEST.get(kind, 6)


@pytest.mark.stress
def test_the_page_of_the_whole_demo_is_small(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def native(scenarios: list[Any], **more: Any) -> Any:
        return hy.run(scenarios, engine="native")

    monkeypatch.setattr(demo, "run", native)
    monkeypatch.setattr(demo, "_export", lambda *given: ([], 0))
    assert demo.demo(tmp_path, full=True)
    size = (tmp_path / "report.html").stat().st_size
    with capsys.disabled():
        print(f"\npage of the whole demo: {size} bytes")
    assert size <= MOST_PAGE
    with opened(browser, tmp_path / "report.html") as p:
        assert p.evaluate(CHECKS) == []
        assert p.locator(".matrix a").count() > 500


@pytest.mark.stress
def test_the_pages_of_the_site_are_accessible(browser: Browser, site: Path) -> None:
    found = {}
    for name in (
        "index",
        "install",
        "explorer",
        "explorer_alone",
        "gallery",
        "papers",
        "tutorial/piezo",
        "reference/blocks",
    ):
        page = browser.new_page(viewport={"width": 1100, "height": 900})
        asked: list[str] = []
        page.on("request", lambda r, asked=asked: asked.append(r.url))
        page.goto((site / f"{name}.html").as_uri())
        page.wait_for_load_state()
        wrong = [url for url in asked if not url.startswith(("file:", "blob:", "data:"))]
        for width, scheme in LOOKS:
            page.set_viewport_size({"width": width, "height": 900})
            page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
            wrong += [f"{width} px, {scheme}: {line}" for line in page.evaluate(CHECKS)]
        found[name] = wrong
        if name == "explorer":
            page.frame_locator("iframe").locator(".status:not(:empty)").wait_for()
        page.close()
    assert found == {name: [] for name in found}


@pytest.mark.stress
def test_the_site_is_searched_without_a_server_and_names_are_short(browser: Browser, site: Path) -> None:
    page = browser.new_page()
    told: list[str] = []
    page.on("pageerror", lambda e: told.append(str(e)))
    page.on("console", lambda m: told.append(m.text) if m.type == "error" else None)
    page.goto((site / "search.html").as_uri() + "?q=hysteresis")
    page.locator("#search-results li a").first.wait_for()
    assert page.locator("#search-results li").count() > 5
    page.locator("#search-results li a").first.click()
    page.wait_for_load_state()
    assert page.locator("h1").count() == 1
    page.goto((site / "reference" / "python.html").as_uri())
    heads = page.locator("dl.class > dt, dl.function > dt").all_text_contents()
    assert len(heads) > 10
    assert [h for h in heads if "hystfmu." in h.partition("(")[0]] == []
    page.goto((site / "index.html").as_uri())
    text = page.locator("[role=main]").text_content() or ""
    assert "pip install" in text
    assert "import hystfmu as hy" in text
    page.close()
    assert told == []


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("sphinx", reason="the site needs the extra docs")
    pytest.importorskip("furo", reason="the site needs the extra docs")
    sys.path.insert(0, str(DOCS))
    import build

    folder = tmp_path_factory.mktemp("site")
    build.build(folder / "docs")
    return folder / "docs" / "html"
