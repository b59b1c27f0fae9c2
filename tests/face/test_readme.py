"""What the pages show runs: programs of the README, its commands, and every command and option that a page names."""

import re
import shlex
from pathlib import Path
from xml.etree import ElementTree

import click
import pytest
from cheap_choice import among_cheap
from invoked import invoked

import hystfmu as hy
from hystfmu.cli import main

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / p for p in ("README.md", "CONTRIBUTING.md", "SECURITY.md", "fmu_build/README.md", "scenarios/README.md")
]
README = PAGES[0].read_text()
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PROGRAMS = [text for page in PAGES for language, text in FENCE.findall(page.read_text()) if language == "python"]
COMMANDS = [
    line.split("  #")[0].strip()
    for language, text in FENCE.findall(README)
    for line in text.splitlines()
    if not language and line.startswith("hystfmu ")
]
# commands that take long, and the tests that run the same
ELSEWHERE = {
    "hystfmu start piezo.csv -o mine": "tests/start/test_start.py",
    "hystfmu run --all --report out": "tests/scenarios/shipped/test_shipped.py",
    "hystfmu run scenarios/pid --set 'plant.hysteresis_w=*1.2'": "tests/scenarios/shipped/test_shipped.py",
    "hystfmu run scenarios/papers --report papers": "tests/scenarios/shipped/test_shipped.py",
    "hystfmu margins scenarios/pid scenarios/pid_observer": "tests/design/test_loop_margins.py",
    "hystfmu study scenarios/pid/draws.study.toml -o draws": "tests/study/test_yield.py",
    "hystfmu ssp scenarios/pid --case sine_10 -o pid.ssp": "tests/scenarios/test_ssp.py",
    "hystfmu simulate pid.ssp -o pid.csv": "tests/scenarios/test_ssp.py",
    "hystfmu simulate pump.fmu --input in.csv -o out.csv": "tests/scenarios/foreign/test_fmu_alone.py",
}


@pytest.fixture
def measured_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A current folder with the CSV files that the examples read."""
    monkeypatch.chdir(tmp_path)
    for name, seed in (("piezo", 0), ("other", 1)):
        hy.synthetic.piezo(60, 1000.0, seed=seed).to_csv(f"{name}.csv")


@pytest.mark.usefixtures("measured_here")
@pytest.mark.parametrize("program", PROGRAMS, ids=range(len(PROGRAMS)))
def test_program_runs_and_prints_what_the_page_says(program: str, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(program, "README.md", "exec"), {})
    printed = iter(capsys.readouterr().out.splitlines())
    for line in re.findall(r"^print\(.*\n# (.*)$", program, re.MULTILINE):
        assert line in printed  # in this order


@pytest.mark.usefixtures("measured_here")
def test_commands_run_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    among_cheap(monkeypatch, 0.2)  # the kinds that are solved by least squares
    for command in COMMANDS:
        if command not in ELSEWHERE:
            invoked(shlex.split(command)[1:])
    assert set(ELSEWHERE) <= set(COMMANDS)
    assert all((ROOT / file).is_file() for file in ELSEWHERE.values())


@pytest.mark.parametrize("command", ELSEWHERE)
def test_command_that_runs_elsewhere_is_understood(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    _, name, *words = shlex.split(command)
    assert main.commands[name].make_context(name, words)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_commands_and_options_that_a_page_names_exist(page: Path) -> None:
    text = page.read_text()
    told = [*re.findall(r"`hystfmu ([^`]+)`", text), *re.findall(r"^hystfmu (.*)$", text, re.MULTILINE)]
    for words in told:
        name, *rest = words.split("  #")[0].split()
        if name == "COMMAND":
            continue
        assert name in main.commands, f"{page.name}: hystfmu {words}"
        known = {o for p in main.commands[name].params if isinstance(p, click.Option) for o in p.opts} | {"--help"}
        options = {w.split("=")[0] for w in rest if re.match(r"--?[a-z]", w)}
        assert options <= known, f"{page.name}: hystfmu {words}"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_links_of_a_page_lead_to_files(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", FENCE.sub("", page.read_text())):
        assert target.startswith("https://") or (page.parent / target).exists(), f"{page.name}: {target}"


def test_the_first_page_is_short_and_shows_a_picture() -> None:
    assert len(README.encode()) < 12_000
    (picture,) = re.findall(r"!\[[^]]+\]\(([^)]+\.svg)\)", README)
    assert README.index(picture) < 1500, "on the first screen"
    svg = (ROOT / picture).read_text()
    assert len(svg) < 20_000
    assert "prefers-color-scheme: dark" in svg
    ElementTree.fromstring(svg)
