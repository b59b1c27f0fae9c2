"""The files around the code say what is true: commands exist, links lead somewhere, versions agree."""

import configparser
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml

import hystfmu

ROOT = Path(__file__).parents[2]
TARGETS = set(re.findall(r"^([a-z][\w-]*):", (ROOT / "Makefile").read_text(), re.MULTILINE))
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))
FORMS = sorted(p for p in (ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml") if p.name != "config.yml")
TRACKED = [Path(p) for p in subprocess.check_output(["git", "ls-files"], cwd=ROOT, text=True).split("\n") if p]
PAGES = [ROOT / p for p in TRACKED if p.suffix == ".md"]
HOOKS = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())


def read_yaml(path):
    return yaml.safe_load(path.read_text())


def made(text):
    """Targets that a text tells the reader to make."""
    spans = re.findall(r"`([^`\n]+)`", text) + re.findall(r"^```\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return {t for span in spans for t in re.findall(r"^\s*make ([a-z][\w-]*)", span, re.MULTILINE)}


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda p: p.name)
def test_workflows_run_targets_of_the_makefile(path):
    jobs = read_yaml(path)["jobs"]
    commands = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    assert commands
    for command in commands:
        make, target, *settings = command.split()
        assert make == "make", f"{path.name}: {command}"
        assert all(re.fullmatch(r"[A-Z]+=\w+", s) for s in settings), f"{path.name}: {command}"
        assert target in TARGETS, f"{path.name}: {command}"


def test_workflows_read_only_what_they_need():
    for path in WORKFLOWS:
        assert read_yaml(path)["permissions"] == {"contents": "read"}, path.name


@pytest.mark.parametrize("hook", HOOKS["repos"][0]["hooks"], ids=lambda h: h["id"])
def test_hooks_run_what_is_there(hook):
    assert [repo["repo"] for repo in HOOKS["repos"]] == ["local"]
    program, *arguments = hook["entry"].split()
    if program == "make":
        assert arguments[0] in TARGETS
    else:
        tool = program.removeprefix(".venv/bin/")
        known = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]["dev"]
        assert program != tool
        assert tool in {"python", *known}
    for argument in arguments:
        assert not argument.endswith(".py") or (ROOT / argument).is_file()
    if "files" in hook:
        assert any(re.search(hook["files"], p.as_posix()) for p in TRACKED), hook["files"]


@pytest.mark.parametrize("path", FORMS, ids=lambda p: p.name)
def test_issue_forms_are_complete(path):
    form = read_yaml(path)
    assert form["name"]
    assert form["description"]
    for field in form["body"]:
        assert field["type"] in {"markdown", "textarea", "input", "dropdown"}
        assert field["attributes"].get("label") or field["attributes"].get("value")


def test_the_version_is_the_same_everywhere():
    cited = read_yaml(ROOT / "CITATION.cff")
    released = re.findall(r"^## \[([^]]+)\]", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert {"cff-version", "message", "title", "authors"} <= cited.keys()
    assert cited["license"] == "BSD-3-Clause"
    assert released[0] == "Unreleased"
    assert cited["version"] in released[1:3]  # a section may be cut before the release that raises the version
    assert cited["version"] == hystfmu.__version__


def test_the_changelog_has_the_headings_of_keep_a_changelog():
    text = (ROOT / "CHANGELOG.md").read_text()
    kinds = set(re.findall(r"^### (.*)$", text, re.MULTILINE))
    assert kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
    dated = re.findall(r"^## \[\d.*$", text, re.MULTILINE)
    assert dated
    assert all(re.fullmatch(r"## \[\d+\.\d+\.\d+\] - \d{4}-\d\d-\d\d", line) for line in dated)


def test_editors_and_formatters_agree_on_the_length_of_a_line():
    editor = configparser.ConfigParser()
    editor.read_string("[root]\n" + (ROOT / ".editorconfig").read_text())
    ruff = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["ruff"]
    assert editor.getint("*", "max_line_length") == ruff["line-length"]
    assert read_yaml(ROOT / ".clang-format")["ColumnLimit"] == ruff["line-length"]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_paths_and_targets_of_a_page_exist(page):
    text = page.read_text()
    links = re.findall(r"\]\(([^)\s]+)\)", text)
    prose = re.sub(
        r"^(`[\w./]+`\n\n)?```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL
    )  # a file to write, its text
    # what looks like a path from the root of the repository, or from the folder of the page
    spans = (re.match(r"[\w.\-/]+", span) for span in re.findall(r"`([^`\n]+)`", prose))
    heads = {p.parts[0] for p in TRACKED if len(p.parts) > 1}
    paths = [m[0] for m in spans if m and m[0].split("/")[0] in heads and "/" in m[0] and m[0] == m.string]
    assert [line for line in prose.splitlines() if len(line) > 120 and line[0] not in "|<"] == []
    for link in links:
        if not re.match(r"https?:|#", link):
            assert (page.parent / link.split("#")[0]).exists(), f"{page.name}: link to {link}"
    for path in paths:
        assert (ROOT / path).exists() or (page.parent / path).exists(), f"{page.name}: `{path}`"
    assert made(text) <= TARGETS, page.name


def test_every_room_is_on_the_map_of_contributing():
    text = (ROOT / "CONTRIBUTING.md").read_text()
    inside = {Path("python/hystfmu"): 3, Path("fmu_build/core"): 3, Path("fmu_build"): 2, Path("scenarios"): 1}
    rooms = {Path(*p.parts[:n]) for p in TRACKED for top, n in inside.items() if top in p.parents and len(p.parts) > n}
    assert len(rooms) > 20
    assert sorted(r.as_posix() for r in rooms if f"`{r.as_posix()}" not in text) == []


def test_the_test_of_pages_finds_a_target_that_is_not_there():
    assert made("`make nonsense` and\n```\nmake demo  # all\n```\n") == {"nonsense", "demo"}


@pytest.mark.skipif(not shutil.which("make"), reason="no make")
def test_every_target_is_phony_or_a_file():
    text = (ROOT / "Makefile").read_text()
    assert set(re.search(r"^\.PHONY: (.*)$", text, re.MULTILINE)[1].split()) == TARGETS


def test_modules_of_tests_have_names_of_their_own():
    """Their folders are no packages: of two modules with one name pytest takes one."""
    names = [p.name for p in TRACKED if p.parts[0] == "tests" and p.name.startswith("test_") and p.suffix == ".py"]
    assert {n for n in names if names.count(n) > 1} == set()


# ---- Text leaves the package through one place: what prints or escapes beside it forgets what the place knows
PACKAGE = Path(__file__).parents[2] / "python" / "hystfmu"
PLACES = {  # spelling: the files that may use it
    "click.echo(": {"report/terminal.py"},
    "click.secho(": set(),
    "html.escape(": {"base/printable.py"},
    "from html import": set(),
    "saxutils": set(),
    "ET.tostring(": {"fmu/archive.py"},
}


@pytest.mark.parametrize("spelling", PLACES)
def test_text_leaves_through_one_place(spelling):
    found = {p.relative_to(PACKAGE).as_posix() for p in PACKAGE.rglob("*.py") if spelling in p.read_text("utf-8")}
    assert found == PLACES[spelling]
