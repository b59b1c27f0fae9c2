"""Results of the shipped closed loops: tracking errors, margins, positioning stage, adaptive inverse, and study speed.

Gains, worst-case parameter sets (corners) and limits are those in the files of the shipped scenarios.
"""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import hystfmu as hy
from hystfmu.scenario.loop.opening import opened_loops, verdicts_of
from hystfmu.scenario.system.case import Cases
from hystfmu.scenario.system.spec import shipped_scenarios
from papers import study_speed
from papers.table import Report, Row, Stated, gathered, report

ROW = Stated(__name__)

FULL = {"draws": 1000}
STEP = 1e-4  # step (s) of the loops at 10 kHz
CORNERS = [f"{gain}_{f}" for gain in ("up", "down") for f in (400, 600)]
MS_DB = 6.0
PERIODIC = ("repetitive", "iterative_learning")  # scenarios with periodic references
# for each reference: largest RMS error in the nominal case and in the worst corner (% of stroke)
ASKED = {"10": (0.03, 0.08), "100": (0.02, 0.75), "broadband": (0.03, 0.12)}
ASKED_PERIODIC = {"10": (0.02, 0.03), "100": (0.015, 0.2)}
NOMINAL = {"10": "sine_10", "100": "sine_100", "broadband": "broadband"}
WORDS = {"10": "10 Hz", "100": "100 Hz", "broadband": "random to 100 Hz"}
STAGE, SCAN = "stage/irc_repetitive", "lines"
ADAPTED = {
    "load_10": ("10 Hz, third period after +20 %", 0.05),
    "load_random": ("random, from 0.2 s after +20 %", 0.05),
    "load_100": ("100 Hz, third period after +20 %", 0.06),
}


@dataclass(frozen=True)
class Structure:
    """Tracking errors and margins of the closed loop with one controller at 10 kHz.

    Attributes
    ----------
    name : str
        Name of the scenario.
    errors : dict of str to float
        RMS error of each case (% of stroke).
    ms_db, delay_steps : float or None
        Peak of the sensitivity (dB) and delay margin (steps) of the nominal loop with the known delay of one step. None
        if the loop is unstable.
    stable_to : float or None
        Largest additional delay (steps) at which the loop is stable in every corner.
    """

    name: str
    errors: Mapping[str, float]
    ms_db: float | None
    delay_steps: float | None
    stable_to: float | None

    def worst(self, reference: str, more: str = "") -> float | None:
        """Return the largest RMS error over the corners for a reference, or None without such cases.

        `reference` is ``10``, ``100`` or ``broadband``. `more` is a part of the case name, such as ``_two_steps``.
        """
        found = [self.errors[c] for c in (f"{k}{more}_{reference}" for k in CORNERS) if c in self.errors]
        return max(found, default=None)

    def nominal(self, reference: str) -> float | None:
        """Return the RMS error of the nominal case for a reference, or None if this case does not exist."""
        return self.errors.get(NOMINAL[reference])

    def excess(self, asked: Mapping[str, tuple[float, float]]) -> float:
        """Return the largest ratio of an RMS error to its limit, or infinity if a case is missing.

        `asked` contains the limits for each reference: for the nominal case and for the worst corner.
        """
        pairs = [(f, a) for k, v in asked.items() for f, a in zip((self.nominal(k), self.worst(k)), v, strict=True)]
        return max(float("inf") if f is None else f / a for f, a in pairs)


def check(data: object) -> None:
    """Raise an ImportError if the package pyarrow, which stores results of studies, is missing. `data` is not used."""
    import pyarrow  # noqa: F401


def table(data: object, progress: Callable[[float], None], draws: int = 100) -> Report:
    """Return a table of the errors and margins of the shipped loops.

    Parameters
    ----------
    data : object
        Not used.
    progress : function
        Function that is called with the completed fraction of the work, 0 to 1.
    draws : int
        Number of runs with random parameters in each study of the positioning stage.
    """
    root = shipped_scenarios()
    parts: list[Callable[[], list[Row]]] = [partial(_loops, root)]
    if (root / STAGE).is_dir():
        parts += [partial(_stage, root)]
        parts += [partial(_stage_draws, root, width, draws) for width in (5, 20)]
    if (root / "adaptive").is_dir():
        parts.append(partial(_adaptive, root))
    parts.append(partial(study_speed.rows, 1000))
    return report(ROW, gathered(parts, progress))


def _loops(root: Path) -> list[Row]:
    """Return table rows of the loops at 10 kHz: the best loop with its targets, then all loops without targets.

    Two loops have targets: one for any reference, and one for periodic references.
    """
    found = [_structure(f) for f in sorted(root.iterdir()) if _is_robust(f)]
    rows = []
    for title, asked, names in (
        ("any reference", ASKED, [s for s in found if s.name not in PERIODIC]),
        ("periodic references", ASKED_PERIODIC, [s for s in found if s.name in PERIODIC]),
    ):
        if names:
            best = min(names, key=lambda s: s.excess(asked))
            rows += _targets(best, f"S18, {title}, {best.name}", asked)
    return rows + [row for s in found for row in _listed(s)]


def _is_robust(folder: Path) -> bool:
    file = folder / "scenario.toml"
    if not file.exists():
        return False
    spec = Cases(file).spec
    return spec.margins is not None and spec.step == STEP


def _structure(folder: Path) -> Structure:
    results = hy.run([folder], engine="native")
    errors = {r.case: r.value("tracking") for r in results}
    scenario = Cases(folder)
    verdicts = {v.limit: v for v in verdicts_of(scenario, opened_loops(scenario))}
    loop = next(r.loop for r in results if scenario.spec.margins is not None and r.case == scenario.spec.margins.case)
    ms_db, delay_steps = (None, None) if loop is None else (loop.Ms_db, loop.delay_steps)
    return Structure(scenario.spec.name, errors, ms_db, delay_steps, verdicts["stable_to_steps"].value)


def _targets(s: Structure, title: str, asked: Mapping[str, tuple[float, float]]) -> list[Row]:
    rows = [
        Row(f"{title}: Ms, one step, dB", ours=s.ms_db, target=MS_DB, note="" if s.ms_db is not None else "unstable"),
        Row(f"{title}: steps beyond the known one, all corners stable", ours=s.stable_to, target=1.0, at_least=True),
    ]
    for key, (nominal, corner) in asked.items():
        rows.append(Row(f"{title}: {WORDS[key]}", ours=s.nominal(key), target=nominal))
        rows.append(Row(f"{title}: {WORDS[key]}, worst corner", ours=s.worst(key), target=corner))
        two = s.worst(key, "_two_steps")
        if two is not None:
            rows.append(Row(f"{title}: {WORDS[key]}, worst corner, two steps", ours=two, note="asked: stable"))
    return rows


def _listed(s: Structure) -> list[Row]:
    """Return table rows without targets for a controller: peak of the sensitivity, delay margins and RMS errors."""
    figures: list[tuple[str, float | None]] = [
        ("Ms, one step, dB", s.ms_db),
        ("delay margin beyond it, steps", s.delay_steps),
        ("corners stable to further steps", s.stable_to),
    ]
    for key, word in WORDS.items():
        figures += [(word, s.nominal(key)), (f"{word}, worst corner", s.worst(key))]
        figures += [(f"{word}, worst corner, two steps", s.worst(key, "_two_steps"))]
    return [Row(f"{s.name}: {what}", ours=value, group="listed") for what, value in figures if value is not None]


def _stage(root: Path) -> list[Row]:
    """Return table rows with the RMS errors of the positioning stage on the scan lines, for every controller.

    Only the loop in `STAGE` has a target. The rows of the other loops are for comparison.
    """
    rows = []
    for folder in sorted(f.parent for f in root.glob("stage/*/scenario.toml")):
        ours = folder == root / STAGE
        for r in hy.run([folder], engine="native"):
            target = 1.0 if ours and r.case == "scan_200" else None
            peak = "" if r.loop is None else f"Ms {r.loop.cells()[0]} dB"
            what = f"{r.case}, scan lines"
            if ours:
                rows.append(Row(f"S19, stage, {what}", ours=r.value(SCAN), target=target, note=peak))
            else:
                rows.append(Row(f"{r.scenario}: {what}", ours=r.value(SCAN), note=peak, group="listed"))
    return rows


def _stage_draws(root: Path, width: int, draws: int) -> list[Row]:
    """Run a study of the positioning stage; return table rows with unstable runs and percentiles of the scan error.

    The study has `draws` runs, in which the modes have random errors of up to `width` percent.
    """
    with TemporaryDirectory() as copied:
        # the number of variations is stated in the study file, so a copy of the file is changed
        stage = Path(copied) / "stage"
        shutil.copytree(root / "stage", stage)
        shared = stage / "draws_5.toml"
        shared.write_text(shared.read_text().replace("n = 1000", f"n = {draws}"))
        outcome = hy.study(Path(copied) / STAGE / f"draws_{width}.study.toml", Path(copied) / "out")
    summary = outcome.summary
    if summary is None:
        return []
    (lines,) = (s for s in summary.spreads if s.metric == SCAN)
    _, median, most, _ = lines.percentiles
    about = f"S19, stage, 100 Hz, modes known to {width} %, {summary.draws} draws"
    rows = [Row(f"{about}: unstable", ours=summary.unstable, target=0.0, note=f"seed {outcome.seed}")]
    rows.append(Row(f"{about}: median on the scan lines", ours=median, target=0.25 if width == 5 else 0.6))
    if width == 5:
        return [*rows, Row(f"{about}: 95 % of the draws", ours=most, target=0.5)]
    return [*rows, Row(f"{about}: worst", ours=lines.worst, target=2.0)]


def _adaptive(root: Path) -> list[Row]:
    """Return table rows with the errors of the adaptive inverse after a change of the plant.

    The adaptive inverse is tested without and with feedback.
    """
    alone = {r.case: r.value("tracking") for r in hy.run([root / "adaptive"], engine="native")}
    rows = [
        Row(f"S20, adaptive inverse: {what}", ours=alone[case], target=target)
        for case, (what, target) in ADAPTED.items()
        if case in alone
    ]
    if (root / "adaptive_pid").is_dir():
        beside = {r.case: r.value("tracking") for r in hy.run([root / "adaptive_pid"], engine="native")}
        rows += [
            Row(f"S20, beside feedback: {case}, error / that without adaptation", ours=beside[case] / fixed, target=1.0)
            for case, fixed in ((c, beside.get(f"{c}_fixed")) for c in beside)
            if fixed
        ]
    return rows
