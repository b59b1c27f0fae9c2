"""The matrix importer x kind x interface: `make importers` prints it and writes python/docs/importers.md.

Every kind of model is fitted to a short record, exported, and run by importers that are not ours: fmpy, libcosim, ecos,
and containers of fmu-manipulation-toolbox, whose checker reads every archive as well.  Every shipped loop runs as an
SSP archive and as one FMU.  A cell is the largest difference from `predict`, or from the reference in the archive, as a
share of the span; "bits" is no difference.  A cell above its bound ends the command with 1.
"""

import os
import re
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parents[2] / "oracles"))

import fmpy
import numpy as np
from fmu_master import Array
from fmu_slave import Slave
from runners import (
    READERS,
    Failure,
    absent,
    error,
    exchange_by_fmpy,
    in_ecos,
    reference,
    run_by_fmpy,
    run_by_libcosim,
    run_in_container,
)
from test_keys import KEYS, H, fitted_model

from hystfmu import Graph, InputError, Model, Unit, signals
from hystfmu.fmu import export_fmu
from hystfmu.graph.graph import sample_time
from hystfmu.scenario import Cases
from hystfmu.scenario.ssp.write import write_loop, write_ssp
from hystfmu.scenario.system.spec import shipped_scenarios

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "python" / "docs" / "importers.md"
ROUNDED = 1e-9  # importers compute times and steps in their own way; PAGE states this, SOLVED and N
SOLVED = 2e-2  # an oscillator: CVode against Newmark's method with steps of a period / 50
RESIDUE = 1e-12  # s
REFUSED = "refused"  # in one line: the units are an algebraic loop inside one graph
N = 200


def from_start(graph: Graph, u0: Array) -> Graph:
    """The graph whose inputs start at u0: libcosim and ecos set inputs only after the initialisation."""
    inputs = [replace(i, start=float(x)) for i, x in zip(graph.inputs, u0, strict=True)]
    return Graph(graph.nodes, graph.wires, inputs, graph.outputs, sort=False, step=graph.step)


def signal(model: Model) -> Array:
    lo, hi = model.provenance.get("span_u", (-1.0, 1.0))
    u = (lo + hi) / 2 + (hi - lo) / 2 * signals.nested_reversals(12, 5, step=0.02)
    return u[:N, None]


def uneven(n: int, whole: bool) -> list[float]:
    """Step sizes: even, halves, long and short ones, the rounding residue of a clock; `whole`: multiples of H."""
    parts = [H, 2 * H, 3 * H, H] if whole else [H, H / 2, H / 2, 1.7 * H, 0.3 * H]
    pattern = [*parts, 5.7e-15, H * (1 + 1e-12)]
    return [pattern[k % len(pattern)] for k in range(n)]


def run_uneven(fmu: Path, folder: Path, graph: Graph, u: Array) -> tuple[Array, Array]:
    """Outputs of the FMU in fmpy and of the Python unit for uneven steps; a zero step before each must do nothing."""
    slave = Slave(fmu, folder, silent=True)  # the refused steps would be printed
    slave.start()
    unit = Unit(graph)
    unit.initialize(0.0)
    (u_name,) = (p.name for p in graph.ports if p.kind == "input")
    (y_name,) = (p.name for p in graph.ports if p.kind == "output")
    t, rows = 0.0, []
    whole = sample_time(graph) is not None
    for value, h in zip(u[:, 0], uneven(len(u), whole), strict=True):
        slave.write([value])
        unit.set(u_name, float(value))
        try:
            slave.fmu.doStep(t, 0.0)
            raise Failure("took a step of 0")
        except Failure:
            raise
        except Exception:  # the FMU refuses it, and stays as it was
            pass
        slave.fmu.doStep(t, h)
        if h > RESIDUE:  # a rest that is rounding is complete before it begins
            for k in range(round(h / H) if whole else 1):
                unit.do_step(t + k * H, H if whole else h)
            t += h
        rows.append((slave.read()[0], unit.get(y_name)))
    slave.free()
    got = np.array(rows)
    return got[:, :1], got[:, 1:]


def problems(fmu: Path) -> float:
    """The number of problems that `fmutool -check` finds."""
    start = "from fmu_manipulation_toolbox.cli.fmutool import fmutool; fmutool()"
    words = [sys.executable, "-c", start, "-input", str(fmu), "-check"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    return sum(line.startswith(("ERROR", "CRITICAL")) for line in (done.stdout + done.stderr).splitlines())


def gap(got: Array, want: Array) -> float:
    """The largest difference as a share of the span; 0 only for bit-identical arrays."""
    if got.shape == want.shape and got.tobytes() == want.tobytes():
        return 0.0
    return float(np.abs(got - want).max() / (np.ptp(want) or 1.0)) or 5e-324


# ---- kinds ----------------------------------------------------------------------------------------------------------
KIND_COLUMNS = (
    "fmpy CS 2", "fmpy CS 3", "fmpy uneven", "fmpy ME 2", "fmpy ME 3", "libcosim CS 2", "ecos CS 2", "ecos CS 3",
    "container 2", "container 3", "fmutool 2", "fmutool 3",
)  # fmt: skip


def kind_row(key: str, model: Model, folder: Path) -> dict[str, float | str]:
    """The cells of a kind of model."""
    u = signal(model)
    graph = from_start(model.graph, u[0])
    want = graph.executor().run(u, graph.n_outputs, H)
    (u_name,) = (p.name for p in graph.ports if p.kind == "input")
    (y_name,) = (p.name for p in graph.ports if p.kind == "output")
    fmus = {fmi: export_fmu(replace(model, graph=graph), folder / f"m{fmi}.fmu", fmi, "m") for fmi in (2, 3)}  # type: ignore[arg-type]
    runs: dict[str, Callable[[], float | str]] = {
        "fmpy uneven": lambda: gap(*run_uneven(fmus[2], folder / "uneven", graph, u))
    }
    for fmi, fmu in fmus.items():
        runs[f"fmpy CS {fmi}"] = lambda f=fmu, d=folder / f"cs{fmi}": gap(run_by_fmpy(f, d, u, H), want)
        if fmi == 2:  # it loads no FMI 3.0, of the Reference FMUs neither
            runs["libcosim CS 2"] = lambda f=fmu: gap(run_by_libcosim(graph, f, u[1:]), want[1:])
        runs[f"ecos CS {fmi}"] = lambda f=fmu: gap(in_ecos(f, [u_name], [y_name], H, u[1:]), want[1:])
        runs[f"container {fmi}"] = lambda f=fmu, d=folder / f"box{fmi}": gap(run_in_container(f, d, u, H), want)
        runs[f"fmutool {fmi}"] = lambda f=fmu: problems(f)
        runs[f"fmpy ME {fmi}"] = lambda f=fmu: exchange(f, graph, u, want)
    return cells(runs, KIND_COLUMNS)


def exchange(fmu: Path, graph: Graph, u: Array, want: Array) -> float:
    """Model Exchange in fmpy: by Euler's method without continuous states, else by CVode with a held input."""
    if not graph.continuous_states:
        return gap(exchange_by_fmpy(fmu, graph, u, "Euler", H), want)
    held = np.full_like(u, u.max())  # fmpy changes inputs only between the steps of CVode
    settled = graph.executor().run(held, graph.n_outputs, H)
    return float(np.abs(exchange_by_fmpy(fmu, graph, held, "CVode", H) - settled).max() / np.ptp(want))


def cells(runs: dict[str, Callable[[], float | str]], columns: tuple[str, ...]) -> dict[str, float | str]:
    found: dict[str, float | str] = {}
    for name in columns:
        try:
            found[name] = runs[name]()
        except Exception as e:
            found[name] = f"{type(e).__name__}: {' '.join(str(e).split())[:100]}"
    return found


# ---- loops ----------------------------------------------------------------------------------------------------------
LOOP_COLUMNS = ("SSP fmpy", "SSP libcosim", "SSP ecos", "FMU fmpy CS 2", "FMU fmpy CS 3")


def loop_row(folder: Path, work: Path) -> dict[str, float | str]:
    """The cells of a shipped loop; a loop that has no archive gives its one line."""
    case = Cases(folder).cases[0]
    archive = work / "loop.ssp"
    try:
        written = write_ssp(case, archive)
    except InputError as e:
        return {"": f"refused: {str(e).rpartition(': ')[2] if 'case' not in str(e) else str(e).split(': ', 2)[2]}"}
    names, rows = reference(archive)
    n = min(len(rows), 1000)
    runs: dict[str, Callable[[], float | str]] = {}
    for reader in READERS:
        missing = absent(reader)
        runs[f"SSP {reader}"] = lambda r=reader, m=missing: (
            float("nan") if m else error(archive, r, case.step, most=n - 1)
        )
    for fmi in (2, 3):
        runs[f"FMU fmpy CS {fmi}"] = lambda fmi=fmi: as_one(case, fmi, names, rows[:n, 1:], work)
    return cells(runs, LOOP_COLUMNS) | {"own order": max(written.differences.values()) / 100}


def as_one(case: object, fmi: int, names: list[str], want: Array, work: Path) -> float | str:
    """The loop as one FMU in fmpy, against the reference of its archive, which is one component as well."""
    try:
        fmu = write_loop(case, work / f"loop{fmi}.fmu", fmi)  # type: ignore[arg-type]
    except InputError as e:
        if "algebraic loop" in str(e):
            return REFUSED
        raise
    outputs = [name.partition(".")[2] for name in names]
    if any(name.partition(".")[0] != names[0].partition(".")[0] for name in names):
        outputs = [name.replace(".", "_") for name in names]
    step = case.step  # type: ignore[attr-defined]
    result = fmpy.simulate_fmu(
        str(fmu), stop_time=(len(want) - 1) * step, step_size=step, output_interval=step, output=outputs,
        fmi_type="CoSimulation",
    )  # fmt: skip
    got = np.column_stack([result[name] for name in outputs])[: len(want)]
    span = np.ptp(want, axis=0)
    return float((np.abs(got - want) / np.where(span > 0, span, 1.0)).max())


# ---- limits of importers, shown by Reference FMUs -------------------------------------------------------------------
def reference_fmus() -> Path | None:
    folder = Path(os.environ.get("HYSTFMU_DATA", ROOT.parent / "shared" / "data")) / "reference_fmus"
    return folder if folder.is_dir() else None


def limits(folder: Path, work: Path) -> list[str]:
    """Sentences on what importers cannot do with Reference FMUs either, each from a run."""
    from libcosimpy.CosimSlave import CosimLocalSlave

    found = []
    for version, place in (("1.0", "fmi1cs"), ("2.0", "fmi2"), ("3.0", "fmi3")):
        fmu = folder / place / "Dahlquist.fmu"
        if not fmu.exists():
            continue
        told = []
        try:
            told.append(f"fmpy computes x = {fmpy.simulate_fmu(str(fmu), stop_time=1.0, step_size=0.1)['x'][-1]:.9g}")
        except Exception as e:
            told.append(f"fmpy reports an error ({str(e)[:60]})")
        loaded = CosimLocalSlave(fmu_path=str(fmu), instance_name="i").ptr()
        told.append("libcosim can load the FMU" if loaded else "libcosim cannot load the FMU")
        copy = work / f"{place}.fmu"
        copy.write_bytes(fmu.read_bytes())
        try:
            x = in_ecos(copy, [], ["x"], 1e-3, np.zeros((1000, 0)))[-1, 0]
            clock = in_ecos(copy, [], [], 1e-4, np.zeros((1000, 0)))[:, 0]
            off = np.abs(clock - np.arange(1, 1001) * 1e-4).max()
            told.append(f"ecos computes x = {x:.9g}, and its time has an error of {off:.0e} s after 0.1 s")
        except Failure as e:
            told.append(f"ecos: {e}")
        found.append(f"Dahlquist, FMI {version}: {'; '.join(told)}.")
    fmu = folder / "fmi2" / "Feedthrough.fmu"
    if fmu.exists():
        (work / fmu.name).write_bytes(fmu.read_bytes())
        rows, off = first_rows(work)
        found.append(
            "Feedthrough, FMI 2.0: the FMU is a component of an SSP archive, and its input is a constant 1. In fmpy "
            f"the output is {rows[0]:g} after the first step and {rows[1]:g} after the second step, because fmpy sets "
            "every connected input to 0 in the first step. Therefore a loop of several components starts differently "
            "in fmpy if its initial values are not 0. The loops of this table are not affected, because each loop is a "
            f"single component. The time of fmpy is also a sum of steps and has an error of {off:.0e} s after 0.1 s."
        )
        try:
            in_ecos(work / fmu.name, [], ["Float64_continuous_output"], 1e-3, np.zeros((1, 0)))
        except Failure as e:
            found.append(f"Feedthrough, FMI 2.0: ecos {e}.")
    return found


def first_rows(work: Path) -> tuple[Array, float]:
    """Rows of fmpy for a constant source before a Reference FMU, and how far its clock is off within 0.1 s."""
    import tomli_w
    from fmpy.ssp.simulation import simulate_ssp

    data = {
        "name": "first_rows",
        "step": 1e-3,
        "stop": 0.01,
        "order": ["source", "fmu"],
        "units": {
            "source": {"block": "reference", "dims": {"m": 1}, "values": {"shape": "steps", "levels": [1.0]}},
            "fmu": {"fmu": "Feedthrough.fmu"},
        },
        "connections": {"fmu.Float64_continuous_input": "source.r"},
        "metrics": {"top": {"kind": "peak", "signal": "fmu.Float64_continuous_output", "limit": 2.0}},
    }
    (work / "scenario.toml").write_text(tomli_w.dumps(data))
    archive = write_ssp(Cases(work).cases[0], work / "first.ssp").path
    result = simulate_ssp(str(archive), stop_time=0.1, step_size=1e-4)
    off = np.abs(result["time"] - np.arange(len(result)) * 1e-4).max()
    return np.array(result["fmu.Float64_continuous_output"]), float(off)


# ---- the table ------------------------------------------------------------------------------------------------------
def bound(column: str) -> float:
    if column.startswith("fmutool"):
        return 0.0
    if column.startswith("fmpy ME"):
        return SOLVED
    return ROUNDED


def text(value: float | str) -> str:
    if isinstance(value, str):
        return value
    return "absent" if value != value else "bits" if value == 0 else f"{value:.0e}"


def wrong(table: dict[str, dict[str, float | str]]) -> list[str]:
    return [
        f"{row}, {column}: {text(value)}"
        for row, found in table.items()
        for column, value in found.items()
        if column and column != "own order" and value != REFUSED and (isinstance(value, str) or value > bound(column))
    ]


def markdown(table: dict[str, dict[str, float | str]], columns: tuple[str, ...], head: str) -> str:
    lines = [f"| {head} | {' | '.join(columns)} |", "|---" * (len(columns) + 1) + "|"]
    for row, found in table.items():
        if "" in found:
            lines.append(f"| {row} | {found['']} {'| ' * (len(columns) - 1)}|")
        else:
            shown = ["ok" if c.startswith("fmutool") and found[c] == 0 else text(found[c]) for c in columns]
            lines.append(f"| {row} | {' | '.join(shown)} |")
    return "\n".join(lines)


def page(old: str, tables: list[str], told: list[str]) -> str:
    """The page with its tables replaced, in their order, and with the list below its last heading replaced."""
    above, heading, _ = old.partition("## Limitations of importers, shown with Reference FMUs\n\n")
    new = iter(tables)
    above = re.sub(r"(?:^\|.*\n)+", lambda _: next(new) + "\n", above, flags=re.MULTILINE)
    shown = [textwrap.fill(f"- {t}", 120, subsequent_indent="  ", break_on_hyphens=False) for t in told]
    return above + heading + ("\n".join(shown) or "No Reference FMUs at hand.") + "\n"


def main() -> int:
    """Print the tables, write the page, and return 1 if a cell is above its bound."""
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level

    log_output_level(CosimLogLevel.ERROR)
    kinds: dict[str, dict[str, float | str]] = {}
    loops: dict[str, dict[str, float | str]] = {}
    with tempfile.TemporaryDirectory(prefix="hystfmu-importers-") as name:
        work = Path(name)
        for key in KEYS:
            place = work / key.replace(" ", "_")
            place.mkdir()
            kinds[key] = kind_row(key, fitted_model(key, {}), place)
            print(key, *(f"{c}: {text(v)};" for c, v in kinds[key].items()), flush=True)
        folder = shipped_scenarios()
        for file in sorted(folder.rglob("scenario.toml")):
            row = file.parent.relative_to(folder).as_posix()
            place = work / row.replace("/", "_")
            place.mkdir(exist_ok=True)
            loops[row] = loop_row(file.parent, place)
            print(row, *(f"{c}: {text(v)};" for c, v in loops[row].items()), flush=True)
        given = reference_fmus()
        (work / "limits").mkdir()
        told = limits(given, work / "limits") if given else []
    columns = (*LOOP_COLUMNS, "own order")
    tables = [markdown(kinds, KIND_COLUMNS, "kind"), markdown(loops, columns, "loop")]
    PAGE.write_text(page(PAGE.read_text(), tables, told))
    print("\n".join(told))
    bad = wrong(kinds | loops)
    n = sum(len(r) for r in (kinds | loops).values())
    print(f"{PAGE.relative_to(ROOT)}: {n} cells, {len(bad)} above their bound", *bad, sep="\n")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
