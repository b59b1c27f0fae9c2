"""Controllers that replace those of a loop: through the command line, against numpy, and on devices that differ."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from own_loop import F_N, LATE, H, N, command, held_mode, loop

import hystfmu as hy
from hystfmu.cli.design import STRUCTURES
from hystfmu.design import structures

NAMES = sorted(STRUCTURES)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    into = tmp_path_factory.mktemp("loops")
    made = loop().case("scan").case("open", set={"law.Ki": 0.0}).case("slow", set={"wanted.frequency": 1 / (2 * N * H)})
    made.save(into / "loop")
    return into


@pytest.fixture(scope="module")
def designed(folder: Path) -> dict[str, dict[str, Any]]:
    """What the command says of each structure."""
    found = {}
    for name in NAMES:
        done = command("design", name, folder / "loop", "-o", folder / name, "--json")
        assert done.exit_code == 0, done.stderr
        found[name] = json.loads(done.stdout)
    return found


def test_there_is_a_command_for_every_structure() -> None:
    assert {k: s.text for k, s in structures.STRUCTURES.items()} == STRUCTURES


@pytest.mark.parametrize("name", NAMES)
def test_the_written_scenario_has_the_controller_alone(
    folder: Path, designed: dict[str, dict[str, Any]], name: str
) -> None:
    told = designed[name]
    table = tomllib.loads((folder / name / "scenario.toml").read_text())
    assert set(table["units"]) == {"device", "gauge", "wanted", name, "undo", "computing"}
    ends = {k: v for k, v in table["connections"].items() if name in (k.split(".")[0], v.split(".")[0])}
    assert ends == {
        f"{name}.y_d": "wanted.r",
        f"{name}.u_ff": "wanted.r",
        f"{name}.y": "gauge.y",
        "undo.v": f"{name}.u",
    }
    assert [c["name"] for c in table["case"]] == ["scan", "slow"]
    assert told["Ms_db"] <= 6
    assert told["margins"]["stable"]
    assert command("run", folder / name).exit_code == 0
    assert command("margins", folder / name).exit_code == 0


def test_a_structure_that_knows_the_mode_is_faster_than_the_integral(designed: dict[str, dict[str, Any]]) -> None:
    slow = designed["integral"]["bandwidth_hz"]
    assert max(d["bandwidth_hz"] for d in designed.values()) > 2 * slow


@pytest.mark.parametrize("name", ["integral", "irc"])
def test_peaks_of_the_sensitivity_are_those_of_the_gains_in_the_file(
    folder: Path, designed: dict[str, dict[str, Any]], name: str
) -> None:
    """C from its definition: backward integral, and the lag for an input on lines between the samples."""
    blocks = tomllib.loads((folder / name / "scenario.toml").read_text())["units"][name]["graph"]["blocks"]
    values = {b["name"]: b.get("values", {}) for b in blocks}
    z = np.exp(1j * np.concatenate([np.geomspace(1e-4, 0.3, 4000), np.linspace(0.3, np.pi, 20000)]))
    C = values["pid"]["Ki"] * H * z / (z - 1) + values["pid"].get("Kp", 0.0)
    if name == "irc":
        (b,), (T, one) = values["damping"]["b"], values["damping"]["a"]
        assert one == 1.0
        p, x = np.exp(-H / T), H / T
        C = C + b * ((1 - (1 - p) / x) * z + (1 - p) / x - p) / (z - p)
    S = 1 / np.abs(1 + C * held_mode(F_N, z) * z ** -float(LATE))
    assert designed[name]["Ms_db"] == pytest.approx(20 * np.log10(S.max()), abs=0.05)


@pytest.mark.parametrize("f", [0.95, 1.05])
@pytest.mark.parametrize("name", NAMES)
def test_a_device_with_its_mode_5_percent_off_stays_stable(
    folder: Path, designed: dict[str, dict[str, Any]], name: str, f: float
) -> None:
    assert designed[name]["loops"] > 4
    table = hy.Scenario.load(folder / name).table
    table["units"]["device"] = loop(f).table["units"]["device"]
    del table["case"]
    errors = []
    for periods in (20, 100):
        table["stop"] = periods * N * H
        table["metrics"]["miss"]["after"] = (periods - 1) * N * H
        errors.append(hy.Scenario.load(folder / name).changed(table).run(engine="native").verdicts[0].value)
    assert errors[1] <= 1.02 * errors[0] + 1e-9


def test_what_cannot_be_reached_is_refused_with_what_can(folder: Path, designed: dict[str, dict[str, Any]]) -> None:
    refused = command("design", "irc", folder / "loop", "-o", folder / "none", "--bandwidth", 900)
    assert refused.exit_code == 2
    assert f"Reachable is {designed['irc']['bandwidth_hz']:.3g} Hz" in refused.stderr
    assert not (folder / "none").exists()


def test_a_notch_needs_a_mode_and_a_name_is_one_of_the_structures(folder: Path) -> None:
    static = hy.Scenario("static", step=H, stop=3 * N * H)
    static.add("device", hy.blocks.PrandtlIshlinskii(w0=0.7, r=[0.1, 0.4], w=[0.2, 0.1]))
    static.add("wanted", hy.blocks.Reference(frequency=100.0)).add("law", hy.blocks.Pid(Kp=0.0, Ki=50.0))
    static.add("late", hy.blocks.Delay(n=1))
    for a, b in (
        ("wanted.r", "law.y_d"),
        ("wanted.r", "law.u_ff"),
        ("device.y", "law.y"),
        ("law.u", "late.u"),
        ("late.y", "device.u"),
    ):
        static.connect(a, b)
    static.metric("miss", "rms_percent", "device.y", "wanted.r").save(folder / "static")
    refused = command("design", "notch", folder / "static", "-o", folder / "none")
    assert refused.exit_code == 2
    assert "must know a mode" in refused.stderr
    assert command("design", "integral", folder / "static", "-o", folder / "slow").exit_code == 0
    with pytest.raises(hy.InputError, match="must be one of integral"):
        hy.redesign.controller(folder / "loop", "magic")


def test_a_controller_of_a_shipped_scenario_keeps_the_limits_of_its_command(tmp_path: Path) -> None:
    done = command("design", "irc", "scenarios/pid", "-o", tmp_path / "irc", "--json")
    assert done.exit_code in (0, 1), done.stderr
    table = tomllib.loads((tmp_path / "irc" / "scenario.toml").read_text())
    (case,) = (c for c in table["case"] if c["name"] == "saturation_10")
    assert case["set"]["irc.pid_u_min"] == -0.95
    assert table["metrics"]["variation"]["signal"] == "irc.u"
    assert command("run", tmp_path / "irc", "--engine", "native").exit_code == done.exit_code
