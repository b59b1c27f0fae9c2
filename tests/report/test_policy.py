"""The policy of every page: it runs what it was written with and nothing else, and it requests nothing."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from kinds_of_pages import KINDS

from hystfmu.report.page import page
from hystfmu.report.plot import Line, Plot

if TYPE_CHECKING:
    from playwright.sync_api import Browser

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


@pytest.mark.parametrize("kind", KINDS)
def test_the_policy_of_a_page_names_its_own_parts(made: Callable[[str], Path], kind: str) -> None:
    text = made(kind).read_text()
    compiles = "'wasm-unsafe-eval'" in check(text).get("script-src", ())
    assert compiles == ('class="explorer"' in text)


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
