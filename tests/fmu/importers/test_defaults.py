"""An FMU in an importer with its defaults: the trajectory that its description promises, or an error.

The loops of the shipped scenarios and twelve kinds of models run in fmpy, in `fmpy simulate`, in libcosim, in ecos, and
in a master that follows the standard to the letter: it sets continuous inputs between the steps, and enters Event Mode
where the unit asks for it only.
"""

import re
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, Literal

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmu_master import ERROR, Array
from fmu_slave import Slave
from runners import Reader, absent, by_ecos, by_libcosim
from test_keys import fitted_model, plant, ramps

from hystfmu import Dataset, InputError, Model, fit, signals
from hystfmu.fmu import export_fmu
from hystfmu.graph.graph import sample_time
from hystfmu.inverse import inverse
from hystfmu.scenario import Cases
from hystfmu.scenario.engine.simulation import simulate
from hystfmu.scenario.ssp.write import write_loop, write_ssp
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.system import build

SCENARIOS = Path(__file__).parents[3] / "scenarios"
SHIPPED = sorted(f.parent.relative_to(SCENARIOS).as_posix() for f in SCENARIOS.rglob("scenario.toml"))
FEW = ("pid", "cascade_static", "stage/irc")
FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
H = 1e-3
Fmi = Literal[2, 3]


# ---- masters --------------------------------------------------------------------------------------------------------
def by_command(fmu: Path, outputs: list[str]) -> tuple[Array, Array]:
    out = fmu.with_suffix(".csv")
    words = [sys.executable, "-m", "fmpy", "simulate", str(fmu), "--output-file", str(out)]
    subprocess.run([*words, "--output-variables", *outputs], check=True, capture_output=True, timeout=120)
    table = np.genfromtxt(out, delimiter=",", names=True)
    return table["time"], np.column_stack([table[n] for n in outputs])


def by_fmpy(fmu: Path, outputs: list[str], **more: Any) -> tuple[Array, Array]:
    table = fmpy.simulate_fmu(str(fmu), output=outputs, **more)
    return table["time"], np.column_stack([table[n] for n in outputs])


def at_steps(reader: Reader, fmu: Path, outputs: list[str]) -> tuple[Array, Array]:
    h, n = defaults(fmu)
    return h * np.arange(1, n + 1), reader(fmu, outputs, h, n)


MASTERS: dict[str, Callable[[Path, list[str]], tuple[Array, Array]]] = {
    "fmpy": by_fmpy,
    "fmpy simulate": by_command,
    "libcosim": partial(at_steps, by_libcosim),
    "ecos": partial(at_steps, by_ecos),
}


def defaults(fmu: Path) -> tuple[float, int]:
    """Return step and number of steps of the default experiment."""
    experiment = fmpy.read_model_description(str(fmu), validate=False).defaultExperiment
    return float(experiment.stepSize), round(float(experiment.stopTime) / float(experiment.stepSize))


class Letter(Slave):
    """A master of FMI 3.0 with Event Mode, or of FMI 2.0, that follows the standard to the letter."""

    def run(self, u: Array, h: float) -> Array | None:
        """Return outputs after the initialisation and after each step; None if the unit refuses a step with Error.

        Row k of u is set before the step to it; u has no columns to leave the inputs as they are.
        """
        self.fmu.reset()
        self.start(u[0])
        self._event(self.fmi == 3)
        got = [self.read()]
        for k in range(1, len(u)):
            self.write(u[k])
            try:
                flags = self.fmu.doStep((k - 1) * h, h)
            except FMICallException as e:
                if e.status == ERROR:
                    return None
                raise
            if flags and flags[0]:
                self.fmu.enterEventMode()
                self._event(True)
            got.append(self.read())
        return np.array(got)

    def _event(self, now: bool) -> None:
        if now:
            assert self.fmu.updateDiscreteStates()[:2] == (False, False)
            self.fmu.enterStepMode()


@pytest.fixture
def letter(tmp_path: Path) -> Iterator[Callable[[Path], Letter]]:
    """Load FMUs; their instances are freed at the end of the test."""
    made: list[Letter] = []

    def load(fmu: Path) -> Letter:
        made.append(Letter(fmu, tmp_path / f"unpacked{len(made)}", events=True))
        return made[-1]

    yield load
    for one in made:
        one.fmu.freeInstance()


# ---- loops ----------------------------------------------------------------------------------------------------------
def names_of(case: Case) -> list[str]:
    return list(case.record) or list(build(case).columns)


def promise(fmu: Path) -> float:
    """Return the largest difference that the description promises, as a share of the span."""
    text = fmpy.read_model_description(str(fmu), validate=False).description
    if text.endswith("have the bits of the scenario's own run"):
        return 0.0
    (found,) = re.findall(r" are within (\S+) % of their span in the scenario's own run$", text)
    return float(found) / 100


def kept(case: Case, fmu: Path, t: Array, got: Array) -> None:
    """Require that the rows at the times t, to the end, are those of the scenario within the promised difference."""
    assert t[-1] >= 0.99 * case.stop
    same(case, fmu, t, got)


def same(case: Case, fmu: Path, t: Array, got: Array) -> None:
    trace, most = simulate(build(case), "native"), promise(fmu)
    rows = np.rint(t / case.step).astype(int)
    np.testing.assert_allclose(t, rows * case.step, rtol=1e-9, atol=1e-9 * case.step)
    for name, y in zip(names_of(case), got.T, strict=True):
        own = trace[name][:: case.ripple]
        span = float(np.ptp(own)) or float(np.abs(own).max()) or 1.0
        # np.genfromtxt reads what `fmpy simulate` writes with 16 digits
        assert np.abs(y - own[rows]).max() <= max(most, 1e-15) * span, name


def loop_of(case: Case, path: Path, fmi: Fmi) -> Path:
    try:
        return write_loop(case, path, fmi)
    except InputError as e:
        pytest.skip(str(e))


def marked(name: str, few: tuple[str, ...]) -> Any:
    return pytest.param(name, marks=[] if name in few else pytest.mark.stress, id=name)


@pytest.mark.some(4)
@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_loop_in_fmpy(name: str, tmp_path: Path) -> None:
    case, fmi = Cases(SCENARIOS / name).cases[0], (2, 3)[SHIPPED.index(name) % 2]
    fmu = loop_of(case, tmp_path / "loop.fmu", fmi)  # type: ignore[arg-type]
    kept(case, fmu, *by_fmpy(fmu, [n.replace(".", "_") for n in names_of(case)]))


@pytest.mark.parametrize("name", [marked(n, FEW[::2]) for n in SHIPPED])
def test_the_reference_inside_is_the_beginning_of_the_scenario(name: str, tmp_path: Path) -> None:
    """Also of the units of an SSP archive: their own default experiment has the step and the end of the scenario."""
    case = Cases(SCENARIOS / name).cases[0]
    fmu = loop_of(case, tmp_path / "loop.fmu", 2)
    with zipfile.ZipFile(fmu) as archive:
        if f"{FOLDER}/input.csv" in archive.namelist():
            pytest.skip("a free input moves in the reference experiment")
        lines = archive.read(f"{FOLDER}/result.csv").decode().splitlines()
    head, rows = lines[0].split(","), np.array([line.split(",") for line in lines[1:]], dtype=float)
    places = [head.index(name.replace(".", "_")) for name in names_of(case)]
    same(case, fmu, rows[:, 0], rows[:, places])
    with zipfile.ZipFile(write_ssp(case, tmp_path / "loop.ssp").path) as archive:
        units = [archive.extract(n, tmp_path) for n in archive.namelist() if n.endswith(".fmu")]
    assert {defaults(Path(unit)) for unit in units} == {(case.step, round(case.stop / case.step))}


@pytest.mark.stress
@pytest.mark.parametrize("name", SHIPPED)
def test_all_cases_of_a_shipped_loop(name: str, fmi: Fmi, tmp_path: Path) -> None:
    """Every other case in FMI 2.0, the others in FMI 3.0: the version has no part in what a case changes."""
    cases = Cases(SCENARIOS / name).cases
    refused = []
    for case in cases[fmi - 2 :: 2] or cases:
        try:
            fmu = write_loop(case, tmp_path / "loop.fmu", fmi)
        except InputError as e:
            refused.append(str(e))
        else:
            kept(case, fmu, *by_fmpy(fmu, [n.replace(".", "_") for n in names_of(case)]))
    if refused:
        pytest.skip(f"{len(refused)} of {len(cases)} cases are no FMU: {refused[0]}")


@pytest.mark.some(1)
@pytest.mark.parametrize("name", [marked(n, FEW) for n in SHIPPED])
def test_a_shipped_loop_to_the_letter(name: str, letter: Callable[[Path], Letter], tmp_path: Path) -> None:
    """In its own steps and in steps of three: all variables have the same bits."""
    case = Cases(SCENARIOS / name).cases[0]
    fmu = loop_of(case, tmp_path / "loop.fmu", 3)
    master, n = letter(fmu), round(case.stop / case.step)
    got, coarse = (master.run(np.zeros((n // m + 1, 0)), m * case.step) for m in (1, 3))
    assert got is not None
    assert coarse is not None
    places = [list(master.outputs).index(name.replace(".", "_")) for name in names_of(case)]
    kept(case, fmu, case.step * np.arange(n + 1), got[:, places])
    assert coarse.tobytes() == got[::3].tobytes()


@pytest.mark.some(1)
@pytest.mark.parametrize("master", ["fmpy simulate", "libcosim", "ecos"])
@pytest.mark.parametrize("name", [marked(n, FEW[:1]) for n in SHIPPED])
def test_a_shipped_loop_in_other_importers(name: str, master: str, tmp_path: Path) -> None:
    if master in ("libcosim", "ecos") and absent(master):
        pytest.skip(f"{master} is not installed")
    case = Cases(SCENARIOS / name).cases[0]
    fmu = loop_of(case, tmp_path / "loop.fmu", 2)
    kept(case, fmu, *MASTERS[master](fmu, [n.replace(".", "_") for n in names_of(case)]))


# ---- kinds of models ------------------------------------------------------------------------------------------------
def creeping(fitted: dict[str, Model], way: str = "") -> Model:
    """Return an actuator with creep, or its inverse; what `fitted_model` finds has none."""
    key = f"creeping {way}"
    if way and key not in fitted:
        fitted[key] = inverse(creeping(fitted), way)
    if key in fitted:
        return fitted[key]
    u = signals.training(14, 3)[::2]
    y, lag = plant(u), 0.0
    for k, v in enumerate(y.copy()):
        lag += (1 - np.exp(-H / 0.05)) * (v - lag)
        y[k] += 0.3 * lag
    data = Dataset.from_signal(u, y, H, "creeping")
    fitted[key] = fit(data, "actuator", seed=1, N=10, dynamics="no", creep="yes")
    return fitted[key]


KINDS: dict[str, Callable[[dict[str, Model]], Model]] = {
    **{
        key: partial(fitted_model, key)
        for key in ("narx_network", "polynomial_narx", "rate_mlp", "bouc_wen_oscillator")
    },
    **{
        key: partial(fitted_model, key)
        for key in ("prandtl_ishlinskii", "preisach", "zhao_tan_mlp", "bouc_wen", "duhem")
    },
    "actuator": creeping,
    "inverse of actuator": partial(creeping, way="exact"),
    "implicit inverse of actuator": partial(creeping, way="implicit"),
}
OFTEN = ("narx_network", "inverse of actuator")


def stimulus(model: Model, n: int) -> Array:
    lo, hi = model.provenance.get("span_u", (-1.0, 1.0))
    return np.resize((lo + hi) / 2 + (hi - lo) / 2 * signals.nested_reversals(12, 5, step=0.02), n)


every_kind = pytest.mark.parametrize("name", [marked(n, OFTEN) for n in KINDS])


@pytest.mark.some(1)
@every_kind
def test_a_model_in_fmpy(name: str, fitted: dict[str, Model], fmi: Fmi, tmp_path: Path) -> None:
    """The default experiment with a table of inputs: an importer that knows them one step late has these bits.

    Also with events: after one that a unit asks for in each step, fmpy would not set the continuous input any more.
    """
    model = KINDS[name](fitted)
    fmu = export_fmu(model, tmp_path / "m.fmu", fmi, "m")
    h, n = defaults(fmu)
    assert (h, n) == (H, 1000)
    u = stimulus(model, n + 1)
    table = np.rec.fromarrays([h * np.arange(n + 1), u], names=("time", *(i.name for i in model.graph.inputs)))
    want = model.predict(np.concatenate([u[:1], u[:-1]]))
    for events in (False, True)[: fmi - 1]:
        t, got = by_fmpy(fmu, [o.name for o in model.graph.outputs], input=table, use_event_mode=events)
        np.testing.assert_allclose(t, table["time"], rtol=1e-12)
        assert got[:, 0].tobytes() == want.tobytes()


@every_kind
def test_a_model_in_other_steps_is_itself_or_refuses(
    name: str, letter: Callable[[Path], Letter], fitted: dict[str, Model], fmi: Fmi, tmp_path: Path
) -> None:
    """Against its own steps with the same input, which is held over the longer of both steps, or is a ramp in it."""
    model = KINDS[name](fitted)
    master, v = letter(export_fmu(model, tmp_path / "m.fmu", fmi, "m")), stimulus(model, 81)
    for part in (0.25, 0.5, 1.0, 2.0, 3.0, 5.0):
        many = round(max(part, 1 / part))
        ramp = np.interp(np.arange(80 * many + 1) / many, np.arange(81), v)
        fine = ramp if ramps(model.graph) else np.concatenate([v[:1], np.repeat(v[1:], many)])
        got = master.run((v if part >= 1 else fine)[:, None], part * H)
        if part < 1 and sample_time(model.graph):
            assert got is None
            continue
        assert got is not None
        want = model.predict(fine)[::many] if part >= 1 else model.predict(v)
        y = got[:, 0] if part >= 1 else got[::many, 0]
        integrated = ramps(model.graph)  # an oscillator by Newmark's method, whose error its page states
        assert np.abs(y - want).max() <= (3e-2 if integrated else 1e-3) * np.ptp(want)
        if sample_time(model.graph):
            assert y.tobytes() == want.tobytes()
