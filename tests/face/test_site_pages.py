"""What the pages of the site show runs: every program and every command, in the order of its page."""

import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from hystfmu.cli import main

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "python" / "docs"
PAGES = [p for p in sorted(DOCS.rglob("*.md")) if "```" in p.read_text() and p.name != "choice.md"]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
DIRECTIVE = re.compile(r"^```\{.*?^```$", re.MULTILINE | re.DOTALL)
FAILS = "exit status 1"
# commands that take long, and the tests that run the same
ELSEWHERE = {"hystfmu study scenarios/pid/draws.study.toml -o out": "tests/study/test_yield.py"}
# pages that design several loops or fit several graphs: tests/start, tests/redesign and identify/estimate have the
# same commands with smaller records
SLOW = {"tutorial/piezo.md", "explanation/promise.md", "howto/loops.md", "howto/graph.md"}


@pytest.mark.some(1)
@pytest.mark.parametrize("page", [
    pytest.param(
        p,
        marks=[pytest.mark.stress] if p.relative_to(DOCS).as_posix() in SLOW else [],
        id=p.relative_to(DOCS).as_posix(),
    )
    for p in PAGES
])  # fmt: skip
def test_programs_and_commands_of_a_page_run(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    names: dict[str, object] = {}
    for language, text in FENCE.findall(DIRECTIVE.sub("", page.read_text())):
        if language == "python":
            exec(compile(text, str(page), "exec"), names)
            printed = capsys.readouterr().out.splitlines()
            for line in re.findall(r"^print\(.*\n# (.*)$", text, re.MULTILINE):
                assert line in printed
        for line in text.splitlines() if not language else ():
            assert line.startswith("hystfmu "), f"{page}: {line}"
            command, _, remark = line.partition("  #")
            if command.strip() in ELSEWHERE:
                assert (ROOT / ELSEWHERE[command.strip()]).is_file()
                continue
            done = CliRunner().invoke(main, shlex.split(command)[1:])
            capsys.readouterr()
            assert done.exit_code == (FAILS in remark), f"{command}\n{done.output}"


def test_every_page_is_in_a_table_of_contents() -> None:
    named = {line for line in (DOCS / "index.md").read_text().splitlines() if line}
    pages = {p.relative_to(DOCS).with_suffix("").as_posix() for p in DOCS.rglob("*.md")} - {"index"}
    assert pages <= named
    assert named >= BUILT


BUILT = {"reference/commands", "reference/blocks", "reference/files", "reference/python", "gallery"}


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda p: p.relative_to(DOCS).as_posix())
def test_references_of_a_page_lead_to_pages(page: Path) -> None:
    for name in re.findall(r"\{doc\}`([^`]+)`", page.read_text()):
        target = (page.parent / name).resolve()
        known = target.with_name(f"{target.name}.md").is_file() or target.relative_to(DOCS).as_posix() in BUILT
        assert known, f"{page.name}: {name}"


@pytest.mark.stress
def test_the_site_builds_without_warning_and_loads_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("sphinx", reason="the site needs the extra docs")
    pytest.importorskip("furo", reason="the site needs the extra docs")
    monkeypatch.syspath_prepend(str(DOCS))
    import build

    build.build(tmp_path / "site")  # warnings, dead links among them, are errors
    html = tmp_path / "site" / "html"
    loaded = re.compile(r"""<(?:script|link|img|iframe)[^>]+(?:src|href)=["']([^"']+)""")
    for page in html.rglob("*.html"):
        for target in loaded.findall(page.read_text()):
            assert not re.match(r"(https?:)?//", target), f"{page}: {target}"
            file = (page.parent / target.partition("?")[0].partition("#")[0]).resolve()
            assert file.exists(), f"{page}: {target}"
    assert (html / "schema" / "scenario.schema.json").exists()
