"""Delays as settings and in the budget; files inside the folder of the scenarios."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from hystfmu.base.errors import InputError
from hystfmu.scenario.system.folders import inside
from hystfmu.scenario.system.spec import UnitSpec
from hystfmu.scenario.system.unit_graph import delayed


def delay(**more: Any) -> UnitSpec:
    return UnitSpec.model_validate({"block": "delay", "dims": {"n": 3}} | more)


# ---- a number of steps ---------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("steps", "unit", "n", "fine"),
    [
        (2, {}, 2, False),
        (2.0, {}, 2, False),
        (0.75, {}, 3, True),
        (1.25, {}, 5, True),
        (1e-7 / 4 + 1, {}, 1, False),
        (5, {"fine": True}, 5, True),
        (5, {"every": 2}, 5, False),
        (250_000_000, {}, 250_000_000, False),
    ],
)
def test_a_fraction_counts_in_fine_steps(steps: float, unit: dict[str, Any], n: int, fine: bool) -> None:
    found = delayed(delay(set={"n": 9, "y0": 0.5}, **unit), steps, 4, "here")
    assert (found.block, found.dims, found.fine, found.set) == ("delay", {"n": n}, fine, {"y0": 0.5})


@pytest.mark.parametrize("unit", [{}, {"fine": True}])
def test_no_step_makes_it_a_connection(unit: dict[str, Any]) -> None:
    for steps in (0, 0.0, 1e-7):
        found = delayed(delay(values={}, set={"n": 9}, **unit), steps, 4, "here")
        assert (found.block, found.dims, found.set, found.fine) == ("scaling", {"n": 1}, {}, bool(unit))


@pytest.mark.parametrize(
    ("steps", "unit", "least"),
    [
        (-1, {}, 0.25),
        (0.3, {}, 0.25),
        (1.0 + 1e-6, {}, 0.25),
        (1.5, {"fine": True}, 1),
        (1.5, {"every": 2}, 1),
        ("2", {}, 0.25),
        (True, {}, 0.25),
        (250_000_001, {}, 0.25),
        (float("nan"), {}, 0.25),
    ],
)
def test_what_is_no_number_of_steps(steps: object, unit: dict[str, Any], least: float) -> None:
    said = f"here: must be a number of steps of at least 0, in steps of {least:g}. Got {steps!r}."
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        delayed(delay(**unit), steps, 4, "here")


# ---- files ---------------------------------------------------------------------------------------------------------


def tree(root: Path) -> Path:
    """Scenarios one/ and group/{two,three}/ among all; a file beside them and one outside."""
    for name in ("all/one", "all/group/two", "all/group/three"):
        (root / name).mkdir(parents=True)
        (root / name / "scenario.toml").touch()
    (root / "all" / "shared").mkdir()
    return root / "all"


def test_a_path_stays_within_the_folder_of_all_scenarios(tmp_path: Path) -> None:
    top = tree(tmp_path)
    assert inside(top / "one", "../shared/m", "w") == (top / "shared" / "m").resolve()
    assert inside(top / "group" / "two", "../../shared/m", "w") == (top / "shared" / "m").resolve()
    assert inside(top / "one", ".", "w", top / "group" / "two") == (top / "one").resolve()
    for folder, path in [("one", "../../out"), ("group/two", "../../../out")]:
        with pytest.raises(InputError, match=r"^w: must stay within the folder of the scenarios; got '\.\./"):
            inside(top / folder, path, "w")
    for path in ("/etc/passwd", "a\\b"):
        with pytest.raises(InputError, match=r"^w: must be a path relative to the scenario, with '/'; got "):
            inside(top / "one", path, "w")
    with pytest.raises(InputError, match=r"^w: .*null.*; got 'a\\x00b'$"):
        inside(top / "one", "a\0b", "w")
