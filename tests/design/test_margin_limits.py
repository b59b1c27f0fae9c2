"""Limits of the linearised loop in a scenario file: verdicts, exit codes, refusals; margins in the result of a run."""

from pathlib import Path

import numpy as np
import pytest
from invoked import invoked

import hystfmu as hy
from hystfmu.scenario.loop.table import margin_table

W = 2 * np.pi * 500
LOOP = Path(__file__).with_name("loop.toml").read_text()  # PID around G0 of 500 Hz, damping 0.7


def folder(tmp_path: Path, limits: str) -> Path:
    (tmp_path / "scenario.toml").write_text(f"{LOOP}\n[margins]\n{limits}\n")
    return tmp_path


def test_limits_that_hold_exit_with_0(tmp_path: Path) -> None:
    made = folder(tmp_path, 'Ms_db = 6\ncorners = ["up_*"]\nslopes = [0.7, 1.3]\nstable_to_steps = 0.5')
    run = invoked(["margins", str(made)])
    rows = [line.split() for line in run.output.splitlines() if line.startswith("loop ")]
    assert [row[-1] for row in rows if row[1] in ("Ms_db", "stable_to_steps")] == ["ok", "ok"]


def test_every_broken_limit_is_a_line_and_exits_with_1(tmp_path: Path) -> None:
    made = folder(tmp_path, 'case = "nominal"\nMs_db = 2\ncorners = ["up_*"]\nslopes = [0.7, 1.3]\nstable_to_steps = 3')
    run = invoked(["margins", str(made)], status=1)
    lines = [line for line in run.output.splitlines() if line.startswith("loop: margins.")]
    assert len(lines) == 2
    assert lines[0].startswith("loop: margins.Ms_db: must be at most 2 at nominal. Got 4.6")
    assert lines[1].startswith("loop: margins.stable_to_steps: must be at least 3 at up_10, the worst of 1. Got ")


@pytest.mark.parametrize(("limits", "why"), [
    ('case = "open"\nMs_db = 6', "margins.case: The case must have a loop. Got 'open' instead."),
    ('corners = ["down_*"]\nstable_to_steps = 1', "margins.corners: A case with a loop must have such a name."),
    ("Ms = 6", "margins.Ms"),
])  # fmt: skip
def test_a_limit_that_nothing_can_meet_is_refused(tmp_path: Path, limits: str, why: str) -> None:
    run = invoked(["margins", str(folder(tmp_path, limits))], status=2)
    assert why in run.output
    assert "Traceback" not in run.output


def test_a_run_has_the_margins_of_its_loops(tmp_path: Path) -> None:
    results = hy.run(folder(tmp_path, "Ms_db = 6"), engine="native", report=tmp_path / "report")
    nominal, up, opened = (r.summary()["margins"] for r in results)
    assert nominal["Ms_db"] == pytest.approx(4.64, abs=0.01)  # PID and G0 of tests/design/test_loop_margins.py
    assert nominal["delay_steps"] == pytest.approx(1.947, abs=0.01)
    w = 0.8 * W
    slower = hy.Node("g0", "transfer_function", {}, {"b": [w**2], "a": [1.0, 1.4 * w, w**2]})
    pid = hy.Node("c", "pid", {}, {"Kp": 1.26, "Ki": 9692.0, "Kd": 7.036e-4})
    assert up["delay_steps"] == pytest.approx(hy.design.margins(hy.design.loop(slower, pid, 1e-4)).delay_steps)
    assert opened is None
    page = (tmp_path / "report" / "report.html").read_text()
    assert "delay margin in steps" in page
    assert ">4.64<" in page


def test_delays_have_a_row_each(tmp_path: Path) -> None:
    run = invoked(["margins", str(folder(tmp_path, "Ms_db = 6")), "--case", "nominal", "--delays"])
    rows = [line.split() for line in run.output.splitlines() if line.startswith("loop ")]
    assert [row[3] for row in rows] == ["0", "0.5", "1", "2"]
    assert [row[-1] for row in rows] == ["stable", "stable", "stable", "unstable"]


def test_the_figures_of_a_table_are_numbers_where_the_loop_is_stable(tmp_path: Path) -> None:
    (row,) = margin_table([folder(tmp_path, "Ms_db = 6")], "nominal", delays=True).rows
    assert row.slopes == (1.0, 1.0)
    at = {d["further_steps"]: d for d in row.at_delay}
    assert list(at) == [0.0, 0.5, 1.0, 2.0]
    for further, d in at.items():
        known = ("Ms_db", "Ms_worst_db", "gain_db", "phase_deg", "delay_steps", "bandwidth_hz")
        assert all((d[key] is not None) == (further < 2) for key in known), d
        if further < 2:
            assert d["Ms_worst_db"] == pytest.approx(d["Ms_db"], rel=1e-3)  # a sector of one slope
            assert d["delay_steps"] == pytest.approx(row.margins["delay_steps"] - further, abs=0.02)
    assert row.margins["Ms_1_db"] == pytest.approx(at[1.0]["Ms_db"])
    assert 1.0 <= row.margins["stable_to_steps"] < 2.0
