"""What is asked of a loop: a stage with a light mode that its record shows, and what no loop of it reaches."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.linalg import expm

import hystfmu as hy
from hystfmu.base import PACKAGE
from hystfmu.cli import main

H, F_N, ZETA = 2.5e-4, 300.0, 0.03
SCHEMA = json.loads((PACKAGE / "start" / "verdict.schema.json").read_text())


def call(*words: object) -> tuple[int, str, str]:
    found = CliRunner().invoke(main, [str(w) for w in words], catch_exceptions=False)
    return found.exit_code, found.stdout, found.stderr


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Plays behind a held command, a mode, noise: nested reversals, then a sweep of small amplitude."""
    rng = np.random.default_rng(4)
    levels = np.concatenate([[0, 0.98, -0.98], 0.9 * rng.uniform(0.1, 1, 32) * (-1.0) ** np.arange(32), [0]])
    rows = 160
    turn = 0.5 - 0.5 * np.cos(np.pi * np.arange(rows) / rows)
    u = np.concatenate([a + (b - a) * turn for a, b in pairwise(levels)])
    t = np.arange(3200) * H
    phase = 2 * np.pi * 10 * (np.exp(np.log(80) * t / t[-1]) - 1) / np.log(80) * t[-1]
    u = 50 + 50 * np.concatenate([u, 0.05 * np.sin(phase)])
    w = 2 * np.pi * F_N
    M = expm(np.array([[0, 1, 0], [-w * w, -2 * ZETA * w, w * w], [0, 0, 0]]) * H)
    x, plays, y = np.array([50.0 + 6.0, 0.0]), np.array([50.0, 50.0, 50.0]), []
    weights, radii = np.array([0.06, 0.04, 0.02]), np.array([5.0, 15.0, 30.0])
    for command in u:
        y.append(x[0])  # a sample comes before the command of its row
        plays = np.clip(plays, command - radii, command + radii)
        x = M[:2, :2] @ x + M[:2, 2] * (command + weights @ plays)
    path = tmp_path_factory.mktemp("stage") / "stage.csv"
    y = 0.1 * np.array(y) + rng.normal(0, 0.002, len(y))
    hy.Dataset(H * np.arange(len(u)), u, y, unit_u="V", unit_y="um").to_csv(path)
    return path


def start(record: Path, *words: object) -> tuple[int, dict[str, Any]]:
    """Run the command; the fit is kept from one call to the next."""
    given = ["start", record, "--model", "prandtl_ishlinskii", "-o", record.parent / "mine", "--json", *words]
    status, out, err = call(*given)
    assert out, err
    told = json.loads(out)
    assert told["verdict"] == json.loads((record.parent / "mine" / "verdict.json").read_text())
    assert told["verdict"]["approved"] is (status == 0)
    return status, told


@pytest.mark.stress
def test_the_mode_of_the_record_gives_a_loop_faster_than_an_integral(record: Path) -> None:
    status, told = start(record)
    (mode,) = told["fit"]["evidence"]["modes"]
    assert mode["f_n"] == pytest.approx(F_N, rel=0.01)
    assert mode["zeta"] == pytest.approx(ZETA, rel=0.2)
    assert (status, told["verdict"]["feedback"]) == (0, "full")
    wide = {c["structure"]: c["bandwidth"] for c in told["race"]}
    assert max(wide.values()) > 3 * wide["integral"]
    assert all(c["Ms_db"] <= 6 and c["Ms_of_all_db"] <= 12 for c in told["race"])
    assert all(c["overshoot_percent"] < 10 for c in told["race"][:1])
    required = SCHEMA["properties"]["references"]["items"]["required"]
    assert all(set(r) == set(required) for r in told["verdict"]["references"])
    loop = record.parent / "mine" / "loop"
    assert call("run", loop)[0] == call("margins", loop)[0] == 0


@pytest.mark.stress
def test_a_bandwidth_is_reached_or_refused_with_what_is_reachable(record: Path) -> None:
    status, told = start(record, "--bandwidth", 45, "--reference", "sine")
    assert status == 0
    assert next(c["bandwidth"] for c in told["race"]) >= 45
    status, told = start(record, "--bandwidth", 900, "--reference", "sine")
    assert status == 1
    (reason,) = told["verdict"]["reasons"]
    assert "the required bandwidth is 900 Hz" in reason
    assert 45 < float(reason.split("the largest one found is ")[1].split(" Hz")[0]) < 300
    assert not (record.parent / "mine" / "loop").exists(), "no loop stays that does not do what is asked"


@pytest.mark.stress
def test_a_controller_can_be_named_or_left_out(record: Path) -> None:
    status, told = start(record, "--controller", "ppf", "--reference", "sine")
    assert (status, told["verdict"]["controller"]) == (0, "ppf")
    status, told = start(record, "--controller", "none", "--reference", "sine")
    assert (status, told["verdict"]["controller"], told["verdict"]["feedback"]) == (0, "none", "none")
    assert "the option --controller is none" in told["verdict"]["reasons"][0]


@pytest.mark.stress
def test_an_error_below_what_the_device_gives_is_refused(record: Path) -> None:
    status, told = start(record, "--error", 1e-4, "--reference", "sine")
    assert status == 1
    assert "the expected one is" in told["verdict"]["reasons"][0]


@pytest.mark.stress
def test_requirements_stand_in_a_file_too(record: Path, tmp_path: Path) -> None:
    (tmp_path / "asked.toml").write_text('controller = "irc"\nreference = ["sine:20"]\ndelay = 2\n')
    status, told = start(record, "--requirements", tmp_path / "asked.toml")
    assert (status, told["verdict"]["controller"]) == (0, "irc")
    assert [r["frequency"] for r in told["verdict"]["references"]] == [20.0]


@pytest.mark.parametrize(("words", "rule"), [
    (["--set", "N=0"], "The option 'N' must be an int in [1, 100000]"),
    (["--controller", "pd"], "The 'controller' must be one of"),
    (["--reference", "square"], "The reference must be one of"),
    (["--reference", "sine:-3"], "frequency of the reference must be a float in (0, inf)"),
    (["--reference", "sine:3000"], "must have at least 20 steps"),
    (["--resonance", "0"], "The resonance must be HZ or HZ,ZETA"),
    (["--amplifier", "speed=3"], "The key of the amplifier must be one of"),
    (["--amplifier", "current=0.1"], "must come with the 'capacitance'"),
    (["--bandwidth", "-1"], "The 'bandwidth' must be a float in (0, inf]"),
    (["--delay", "-1"], "The 'delay' must be an int in [0, 1000] steps"),
])  # fmt: skip
def test_a_bad_requirement_is_one_line(record: Path, words: list[str], rule: str) -> None:
    status, out, err = call("start", record, "--model", "prandtl_ishlinskii", "-o", record.parent / "mine", *words)
    line = [line for line in (out + err).splitlines() if rule in line]
    assert status == 2 or (status == 1 and line[0].startswith("no loop: "))
    assert line, out + err


def test_a_bad_reference_in_a_file_is_one_line(record: Path, tmp_path: Path) -> None:
    (tmp_path / "asked.toml").write_text('reference = ["sine:20", 3]\n')
    words = ["--requirements", tmp_path / "asked.toml", "-o", tmp_path / "mine"]
    status, _, err = call("start", record, "--model", "prandtl_ishlinskii", *words)
    assert (status, err.count("\n")) == (2, 1)
    rule = "The 'reference' must be SHAPE, SHAPE:HZ or a file, or a list of these. Got ['sine:20', 3]"
    assert f"{tmp_path / 'asked.toml'}: {rule}" in err
