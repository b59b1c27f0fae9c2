"""`hystfmu run -o`: all rows of one case; an option that would have no effect is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hystfmu.cli import main
from hystfmu.scenario import Cases, build, simulate
from hystfmu.scenario.ssp.write import write_ssp


def command(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str]:
    """Exit status and what the user reads."""
    with pytest.raises(SystemExit) as done:
        main([str(w) for w in words])
    out, err = capsys.readouterr()
    return int(done.value.code or 0), (out + err).strip()


def test_a_case_as_csv(loop: Any, write: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    loop["case"] = [{"name": "one"}, {"name": "two", "set": {"pid.Kp": 0.5}}]
    path, out = write(loop), tmp_path / "two.csv"
    assert command(capsys, "run", path, "--engine", "native", "--record", "--yes")[0] == 0
    assert command(capsys, "run", path, "--engine", "native", "--case", "two", "-o", out)[0] == 0
    whole = simulate(build(next(c for c in Cases(path).cases if c.name == "two")), "native")
    assert out.read_text().splitlines()[0] == ",".join(["t", *whole.columns])
    assert np.loadtxt(out, delimiter=",", skiprows=1).tobytes() == np.column_stack([whole.t, whole.values]).tobytes()


def test_a_run_that_stops_leaves_no_file(
    loop: Any, write: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    loop["units"]["large"] = {"block": "sum", "dims": {"n": 1}, "values": {"k": [1e308]}}
    loop["units"]["reference"]["values"]["amplitude"] = 1e6
    loop["units"]["pid"]["inputs"] = {}
    loop["order"] = ["plant", "reference", "large", "pid"]
    loop["connections"] |= {"large.u": "reference.r", "pid.u_ff": "large.y"}
    folder = tmp_path / "out"
    folder.mkdir()
    status, said = command(capsys, "run", write(loop), "--engine", "native", "-o", folder / "x.csv")
    assert status == 1
    assert "stopped" in said
    assert not any(folder.iterdir())


def test_options_without_effect_are_refused(
    loop: Any, write: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    loop["case"] = [{"name": "one"}, {"name": "two"}]
    path = write(loop)
    archive = write_ssp(Cases(path).cases[0], tmp_path / "loop.ssp", separate=True).path
    for words, part in [
        ((path, "-o", tmp_path / "x.csv"), "2 cases would run; select one with --case"),
        ((path, "--case", "three"), "--case three: no such case; there are one, two"),
        ((path, "--case", "one", "--record"), "not be combined with --case"),
        ((path, "--stop", "1"), "No such option '--stop'"),
        ((archive, "--junit", "x.xml"), f"'hystfmu simulate {archive}'"),
    ]:
        status, said = command(capsys, "run", *words)
        assert status == 2
        assert part in said
        assert len(said.splitlines()) == 1
    assert not (tmp_path / "x.csv").exists()


def test_several_cases_are_all_run(loop: Any, write: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    loop["case"] = [{"name": "one"}, {"name": "two"}, {"name": "three"}]
    path = write(loop)
    words = ("run", path, "--engine", "native", "--json", "--case", "three")
    for more, ran in [((), ["three"]), (("--case", "one"), ["one", "three"])]:
        assert [r["case"] for r in json.loads(command(capsys, *words, *more)[1])] == ran
    assert command(capsys, *words, "--case", "four") == (
        2,
        "hystfmu: --case four: no such case; there are one, two, three.",
    )
