"""`start` as it comes, with the kind of model that it chooses: the demo's record, a measured one, a poor one."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.data.synthetic import displacement, piezo

pytestmark = pytest.mark.stress
DATA = Path(os.environ.get("HYSTFMU_DATA", Path(__file__).parents[3] / "shared" / "data"))
MEASURED = DATA / "dbo_piezo" / "Test_Vi_Do_Di.dat"


def _measured(path: Path) -> None:
    if not MEASURED.exists():
        pytest.skip(f"measured data absent: {MEASURED}")
    rows = np.loadtxt(MEASURED)
    lines = ["Zeit [ms];Spannung [V];Auslenkung [µm]"]
    lines += [f"{5 * k:.1f};{r[0]:.6f};{r[4]:.6f}".replace(".", ",") for k, r in enumerate(rows)]
    path.write_text("\r\n".join(lines), encoding="cp1252")


def _poor(path: Path) -> None:
    k = np.arange(300)
    u = 50 + 50 * np.exp(-0.003 * k) * np.sin(2 * np.pi * k / 50)
    noise = np.random.default_rng(3).normal(0, 0.003, 300)
    hy.Dataset(1e-3 * k, u, displacement(u, 1e-3) + noise).to_csv(path)


RECORDS = {"demo": lambda path: piezo(seed=0).to_csv(path), "measured": _measured, "poor": _poor}


@pytest.mark.parametrize("record", RECORDS)
def test_ends_with_a_loop_and_a_whole_report(record: str, tmp_path: Path) -> None:
    RECORDS[record](tmp_path / "data.csv")
    found = CliRunner().invoke(main, ["start", str(tmp_path / "data.csv"), "-o", str(tmp_path / "mine"), "--json"])
    assert found.exit_code == 0, found.output
    told = json.loads(found.stdout)
    assert all(Path(f["path"]).exists() for f in told["files"].values())
    page = (tmp_path / "mine" / "report.html").read_text()
    assert page.index('<p class="answer">verdict: ') < page.index("before: a gain alone")
    assert all(f">{title}</h2>" in page for title in ("Errors", "Model", "Controller"))
    if record == "poor":
        assert any("informative" in w for w in told["fit"]["warnings"])
        assert (tmp_path / "mine" / "measure_next.csv").exists()
