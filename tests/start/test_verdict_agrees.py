"""One verdict: terminal, page, JSON, verdict.json and exit status of `start` say it, and so do the commands after it.

The records are of devices of many kinds.  Which verdict is right is the matter of tests/benchmarks/devices.py.
"""

import html
import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from compiled import alone
from start.devices.records import write
from start.devices.small import RECORDS

from hystfmu.cli import main

SENTENCE = re.compile(r"verdict: (approved|not approved), (feedback|slow feedback|no feedback)")
FEEDBACK = {"feedback": "full", "slow feedback": "slow", "no feedback": "none"}
QUICK = ("static_plays",)  # the records of the other devices are stress tests
STUDIES = ("static_plays",)  # 200 draws
CHOSEN = ("short", "bouc_wen", "creep_alone")  # the stress tests also let `start` choose the kind of these
MODELS = {  # records whose kind is known: only the others wait for a choice
    "short": "prandtl_ishlinskii",
    "bouc_wen": "bouc_wen",
    "creep_alone": "actuator",
    "static_plays": "prandtl_ishlinskii",
    "noisy": "prandtl_ishlinskii",
    "stage_chirp": "g0_prandtl_ishlinskii",
    "stage_reversals": "prandtl_ishlinskii",
    "bent_stage": "g0_bouc_wen",  # another class
}


def call(*words: object) -> tuple[int, str]:
    found = CliRunner().invoke(main, [str(w) for w in words], catch_exceptions=False)
    return found.exit_code, found.output


@dataclass(frozen=True)
class Made:
    """What `start` wrote and said on a terminal."""

    words: list[str]
    folder: Path
    status: int
    terminal: str
    verdict: dict[str, Any]

    @property
    def loop(self) -> Path:
        return self.folder / "loop"

    @property
    def misfitted(self) -> bool:
        """Whether the model does not follow its record: no loop knows that."""
        return any("another kind" in r["reason"] for r in self.verdict["references"])

    @property
    def of_loop(self) -> int:
        return 0 if self.misfitted else self.status


@pytest.fixture(scope="module")
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Made:
    """Start from a record once for all processes of the run."""
    name, _, chosen = request.param.partition(" ")
    base = tmp_path_factory.getbasetemp()  # of a process of the run, within that of the run
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / f"verdict_{name}{chosen}"
    folder.mkdir(exist_ok=True)
    kept = folder / "said.json"
    model = ["--model", MODELS[name]] if name in MODELS and not chosen else []
    words = ["start", str(folder / f"{name}.csv"), "-o", str(folder / "mine"), *model]
    with alone(folder):
        if not kept.exists():
            write(folder / f"{name}.csv", *RECORDS[name]())
            kept.write_text(json.dumps(call(*words)))
    verdict = json.loads((folder / "mine" / "verdict.json").read_text())
    return Made(words, folder / "mine", *json.loads(kept.read_text()), verdict)


PARAMETERS = [
    *QUICK,
    *(pytest.param(n, marks=pytest.mark.stress) for n in RECORDS if n not in QUICK),
    *(pytest.param(f"{n} chosen", marks=pytest.mark.stress) for n in CHOSEN),
]
every_record = pytest.mark.parametrize("made", PARAMETERS, indirect=True, scope="module")


@pytest.mark.turn("start", name="verdict")
@every_record
def test_exit_status_and_file_are_one_verdict(made: Made) -> None:
    assert made.status == (0 if made.verdict["approved"] else 1), made.verdict["reasons"]
    assert made.verdict["approved"] or made.verdict["reasons"]
    assert (made.verdict["feedback"] == "none") == (made.verdict["controller"] == "none")
    assert made.loop.exists() == (made.verdict["step"] is not None)


@pytest.mark.stress  # of another record: test_start.py
@every_record
def test_json_has_the_verdict_of_the_file(made: Made) -> None:
    status, told = call(*made.words, "--json")
    assert status == made.status
    assert json.loads(told[told.index("{") :])["verdict"] == made.verdict


@pytest.mark.turn("start", name="verdict")
@every_record
def test_terminal_and_page_say_the_verdict(made: Made) -> None:
    page = html.unescape((made.folder / "report.html").read_text())
    for text in (made.terminal, page):
        said = {(word == "approved", FEEDBACK[feedback]) for word, feedback in SENTENCE.findall(text)}
        assert said == {(made.verdict["approved"], made.verdict["feedback"])}
        for reason in made.verdict["reasons"]:
            assert reason in text


@pytest.mark.turn("start", name="verdict")
@every_record
def test_terminal_and_page_state_the_errors(made: Made) -> None:
    """A number that is not known is nowhere a number."""
    page = re.sub(r"<[^>]*>", " ", html.unescape((made.folder / "report.html").read_text()))
    for r in made.verdict["references"]:
        shown = [_shown(r[key]) for key in ("rms_percent", "bound_percent", "model_percent")]
        row = rf"(?m)\b{r['name']} +[0-9.e+-]+ +" + r"\s+".join(map(re.escape, shown))
        assert re.search(row, made.terminal), row
        assert re.search(row.replace(" +", r"\s+"), page), row


def _shown(value: float | None) -> str:
    return "not known" if value is None else "< 0.001" if value < 0.001 else f"{value:.3g}"


@pytest.mark.stress
@pytest.mark.parametrize("made", ["bent_stage"], indirect=True, scope="module")
def test_a_fit_at_a_bound_with_an_error_far_above_the_noise_is_not_approved(made: Made) -> None:
    (why,) = {r["reason"] for r in made.verdict["references"]}
    assert why.startswith("the fit ended at a bound of ")
    assert "the noise is 0.05" in why
    assert made.verdict["reasons"][0] == why
    assert why in made.terminal.splitlines()[-1]
    assert not made.verdict["approved"]


@pytest.mark.stress  # of another record: test_start.py
@every_record
def test_run_and_margins_end_as_start_did(made: Made) -> None:
    if not made.loop.exists():
        pytest.skip("no loop")
    for command in ("run", "margins"):
        status, text = call(command, made.loop)
        assert status == made.of_loop, text


def _study(made: Made, out: Path) -> None:
    file = made.folder / "devices.study.toml"
    if not file.exists():
        pytest.skip("no study")
    status, text = call("study", file, "-o", out)
    assert status == made.of_loop, text


@pytest.mark.turn("start", name="verdict")
@pytest.mark.parametrize("made", STUDIES, indirect=True, scope="module")
def test_a_study_ends_as_start_did(made: Made, tmp_path: Path) -> None:
    _study(made, tmp_path / "devices")


@pytest.mark.stress
@pytest.mark.parametrize("made", [n for n in RECORDS if n not in STUDIES], indirect=True, scope="module")
def test_every_study_ends_as_start_did(made: Made, tmp_path: Path) -> None:
    _study(made, tmp_path / "devices")
