"""The policy of every page: it runs what it was written with and nothing else, and it requests nothing."""

import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from opened_page import EACH, Browser, dragged, opened
from scripts import loaded

import hystfmu as hy
from hystfmu.base import PACKAGE
from hystfmu.report.page import page
from hystfmu.report.plot import Line, Plot

POLICY = re.compile(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">')
PART = re.compile(r"<(style|script)([^>]*)>(.*?)</\1>", re.DOTALL)
FOREIGN = (
    "<script>document.title = 'run'</script>",
    "<img src='data:image/gif;base64,none' onerror=\"document.title = 'run'\">",
    "<style>h1 { color: rgb(1, 2, 3) }</style>",
    "<iframe src='data:text/html,<p>framed</p>'></iframe>",
    "<form action='https://example.org'><button>send</button></form>",
)


def rules_of(text: str) -> dict[str, list[str]]:
    (stated,) = POLICY.findall(text)
    assert text.index("<meta http-equiv") < min(m.start() for m in PART.finditer(text))
    return {words[0]: words[1:] for words in (rule.split() for rule in stated.split(";"))}


def check(text: str) -> dict[str, list[str]]:
    """A page whose policy names its own styles and scripts and nothing more."""
    rules = rules_of(text)
    found: dict[str, set[str]] = {"style": set(), "script": set()}
    for kind, attributes, content in PART.findall(text):
        if "application/json" not in attributes:  # data, which no browser runs
            digest = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
            found[kind].add(f"'sha256-{digest}'")
    assert rules["default-src"] == rules["base-uri"] == rules["form-action"] == ["'none'"]
    assert set(rules["style-src"]) == found["style"]
    assert set(rules.get("script-src", ())) - {"'wasm-unsafe-eval'"} == found["script"]
    assert not re.search(r"<[^>]*\s(style|on\w+)=", PART.sub("", text))
    return rules


@pytest.mark.some(4)
@pytest.mark.parametrize("kind", EACH)
def test_a_page_is_small_and_its_policy_names_its_own_parts(made: Callable[[str], Path], kind: str) -> None:
    text = made(kind).read_text()
    compiles = "'wasm-unsafe-eval'" in check(text).get("script-src", ())
    assert compiles == ('class="explorer"' in text)
    script = text.rpartition("<script>")[2].partition("</script>")[0] if "<script>" in text else ""
    assert len(script.encode()) <= 30_000
    assert len(text.encode()) <= (600_000 if kind == "demonstration" else 1_000_000)


def test_the_file_of_a_plot_has_a_policy(tmp_path: Path) -> None:
    t = np.linspace(0, 1, 9)
    check(Plot("loop", "u", "y", [Line("y", t, t)]).save(tmp_path / "plot.html").read_text())


def test_a_page_runs_nothing_that_it_was_not_written_with(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(page("quiet", ["<h1>quiet</h1>", *FOREIGN]))
    shown = browser.new_page()
    told: list[str] = []
    shown.on("console", lambda m: told.append(m.text))
    shown.goto(file.as_uri())
    assert shown.title() == "quiet"
    assert shown.evaluate("getComputedStyle(document.querySelector('h1')).color") != "rgb(1, 2, 3)"
    with shown.expect_console_message(lambda m: "form-action" in m.text):
        shown.evaluate("document.querySelector('button').click()")
    assert shown.url == file.as_uri()
    for rule in ("script-src", "inline event handler", "style-src", "Loading the image", "Framing", "form-action"):
        assert any(rule in line for line in told), rule
    shown.close()


# ---- The explorer in the four ways in: the demo, the docs, a wheel, the source archive; a pointer drags in each page

ROOT = Path(__file__).parents[2]
BUILD = (
    "import sys, scikit_build_core.build as b; print(getattr(b, sys.argv[1])(sys.argv[2], {'wheel.cmake': 'false'}))"
)
USE = """
import sys
sys.meta_path[:] = [f for f in sys.meta_path if "scikit" not in type(f).__name__.lower()]  # of an editable installation
import hystfmu as hy
assert hy.__file__.startswith(sys.argv[1]), hy.__file__
data = hy.synthetic.piezo(20, 1000.0)
hy.fit(data, "prandtl_ishlinskii", N=10).report(data, "fit.html")
"""


def moves(browser: Browser, page: Path) -> dict[str, np.ndarray]:
    """The path of a drag, which the models of the page follow."""
    with opened(browser, page) as p:
        found = dragged(p)
    outputs = [v for k, v in found.items() if k not in ("t", "u", "wanted")]
    assert len(found["u"]) > 200
    assert all(np.isfinite(v).all() and np.ptp(v) > 0 for v in outputs)
    assert outputs
    return found


@pytest.mark.stress
def test_in_the_demo(browser: Browser, made: Callable[[str], Path]) -> None:
    page = made("demonstration")
    found = moves(browser, page)
    model = hy.Model.load(page.parent / "models" / "actuator.model.toml")
    assert found["actuator"].tolist() == model.predict(found["u"]).tolist()  # bit for bit


@pytest.mark.stress
def test_in_the_docs(browser: Browser, tmp_path: Path) -> None:
    build = loaded(ROOT / "python" / "docs" / "build.py")
    (tmp_path / "explorer_alone.html").write_text(build.explored())
    moves(browser, tmp_path / "explorer_alone.html")


@pytest.mark.stress
def test_in_a_wheel_that_is_built_from_the_source_archive(browser: Browser, tmp_path: Path) -> None:
    """The files of the wheel are those of the archive; compiled libraries come from this installation."""
    pytest.importorskip("scikit_build_core")
    copy = tmp_path / "copy"
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if name.startswith(("python/", "fmu_build/")) or "/" not in name:
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, copy / name)
    dist = tmp_path / "dist"
    sdist = made_by("build_sdist", dist, copy)
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path / "archive", filter="data")
    (source,) = (tmp_path / "archive").iterdir()
    wheel = made_by("build_wheel", dist, source)
    site = tmp_path / "site"
    shutil.unpack_archive(wheel, site, "zip")
    for name in ("_core.*", "_fmu.*", "LICENSE"):
        for library in PACKAGE.glob(name):
            shutil.copy(library, site / "hystfmu")
    environment = os.environ | {"PYTHONPATH": str(site)}
    subprocess.run([sys.executable, "-c", USE, site], cwd=tmp_path, env=environment, check=True)
    moves(browser, tmp_path / "fit.html")


def made_by(what: str, dist: Path, where: Path) -> Path:
    """The file that the backend of pyproject.toml makes of a source tree."""
    words = [sys.executable, "-c", BUILD, what, dist]
    done = subprocess.run(words, cwd=where, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return dist / done.stdout.split()[-1]
