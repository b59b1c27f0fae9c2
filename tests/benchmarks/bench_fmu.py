"""P1, P5: time of setReal(2) + doStep + getReal for a 2-12-1 net and cost of its export, compared with other tools.

One C master (`fmu_step_master.c`) drives all FMUs in turns under equal conditions; the reference is the bare C function
with libm.  Other tools from PyPI are installed once into a virtual environment in build/.  They are skipped with a
message if their installation or build fails.
"""

import itertools
import os
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np

from hystfmu import Dataset, fit, signals
from hystfmu.fmu.write import platforms
from hystfmu.fmu.write.export import export_fmu
from hystfmu.graph.blocks import Mlp
from hystfmu.report.terminal import table

HERE = Path(__file__).resolve().parent
RIVALS = HERE.parents[1] / "build" / "rivals"
STEPS, REPEATS = 4000, 1500
HEADERS = ["-isystem", str(Path(fmpy.__file__).parent / "c-code")]

PYTHONFMU = """
import math
from pythonfmu import Fmi2Causality, Fmi2Slave, Real
class Net(Fmi2Slave):
    def __init__(self, **k):
        super().__init__(**k)
        self.u_1 = self.u_2 = self.y = 0.0
        for name in ("u_1", "u_2"):
            self.register_variable(Real(name, causality=Fmi2Causality.input, start=0.0))
        self.register_variable(Real("y", causality=Fmi2Causality.output))
    def do_step(self, t, h):
        y = B2
        for (p, q), b, w in zip(W1, B1, W2):
            y += w / (1 + math.exp(-(b + p * self.u_1 + q * self.u_2)))
        self.y = y
        return True
"""
# the master runs inside a Python process, because the library of pythonfmu needs its symbols
RUN = """
import ctypes, sys
a = [x.encode() for x in sys.argv[1:]]
ctypes.CDLL(a[0]).main(len(a), (ctypes.c_char_p * len(a))(*a))
"""


class Skipped(Exception):
    """The reason why a tool has no result."""


def command(*words, makes=None, seconds=600, **options):
    """Run a command; if it fails or does not write `makes`, raise `Skipped` with its errors."""
    try:
        done = subprocess.run([*map(str, words)], capture_output=True, text=True, timeout=seconds, **options)
    except (OSError, subprocess.TimeoutExpired) as e:
        raise Skipped(str(e)) from e
    if done.returncode or (makes and not makes.exists()):
        lines = [f"exit {done.returncode}", *done.stdout.splitlines(), *done.stderr.splitlines()]
        errors = [x.strip() for x in lines if "Error" in x or "ERROR" in x]
        raise Skipped(" | ".join(errors[:2] or lines[-1:])[:200])
    return done.stdout


def compiled(folder, source, *flags):
    target = folder / source.replace(".c", ".so")
    command(
        "cc", "-std=gnu99", "-O3", *HEADERS, f"-I{folder}", f"-I{HERE}", HERE / source, "-o", target, "-shared",
        "-fPIC", "-lm", *flags,
    )  # fmt: skip
    return target


class Fmu:
    """An unpacked FMU 2.0 and the arguments that the master needs."""

    def __init__(self, path, folder):
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder)
        root = ElementTree.parse(folder / "modelDescription.xml").getroot()
        references = {"input": [], "output": []}
        for v in root.iter("ScalarVariable"):
            if v.get("causality") in references:
                references[v.get("causality")].append(v.get("valueReference"))
        name = root.find("CoSimulation").get("modelIdentifier")
        (library,) = folder.glob(f"binaries/linux64/{name}.so")
        resources = (folder / "resources").as_uri()
        self.words = [library, root.get("guid"), resources, *references["input"], *references["output"]]


def rival_python(*packages):
    """Return the interpreter of build/rivals with the packages installed, and its environment."""
    python = RIVALS / packages[0] / "bin" / "python"
    if not python.exists():
        command(sys.executable, "-m", "venv", python.parents[1])
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    environment["PATH"] = f"{python.parent}{os.pathsep}{environment['PATH']}"  # its cmake, its conan
    environment["CONAN_HOME"] = str(RIVALS / "conan")
    command(python, "-m", "pip", "install", "--quiet", *packages, env=environment)
    return python, environment


def pythonfmu(folder, net):
    python, environment = rival_python("pythonfmu", "setuptools")
    constants = {"W1": net["W1"], "B1": net["b1"], "W2": net["W2"][0], "B2": net["b2"][0]}
    head = "".join(f"{name} = {value!r}\n" for name, value in constants.items())
    (folder / "net.py").write_text(head + PYTHONFMU)
    begin = time.perf_counter()
    made = folder / "Net.fmu"
    build = ["-m", "pythonfmu", "build", "-f", "net.py", "-d", folder]
    command(python, *build, makes=made, cwd=folder, env=environment)
    return made, time.perf_counter() - begin


def steps(activation, rivals, folder):
    """Return rows: name, ns per step, ratio to the bare function, largest difference, time and size of the export."""
    rng = np.random.default_rng(0)
    net = {"W1": rng.normal(size=(12, 2)), "b1": rng.normal(size=12), "W2": rng.normal(size=(1, 12)), "b2": [0.1]}
    graph = Mlp(n_in=2, n_hidden=12, n_out=1, activation=activation, **net).graph
    net = {k: np.asarray(v).tolist() for k, v in net.items()}
    numbers = {k: ", ".join(repr(x) for x in np.ravel(v).tolist()) for k, v in net.items()}
    weights = [f"static const double {k}[] = {{{numbers[k]}}};" for k in ("W1", "b1", "W2")]
    weights += [f"static const double b2 = {numbers['b2']};", f"enum {{ TANH = {int(activation == 'tanh')} }};", ""]
    (folder / "fmu_step_weights.h").write_text("\n".join(weights))
    master = compiled(folder, "fmu_step_master.c", "-ldl")
    minimal = [compiled(folder, "fmu_step_minimal.c"), "-", "-", 0, 1, 2]
    begin = time.perf_counter()
    ours_path = export_fmu(graph, folder / "ours.fmu")
    cost = [f"{1e3 * (time.perf_counter() - begin):.0f} ms", f"{ours_path.stat().st_size / 1000:.0f} kB"]
    ours = Fmu(ours_path, folder / "ours").words

    def figures(*fmus):
        options = [STEPS if len(fmus) < 3 else 500, REPEATS if len(fmus) < 3 else 40]
        out = command(sys.executable, "-c", RUN, master, *options, *(w for f in fmus for w in f), cwd=folder)
        return [[float(x) for x in line.split()] for line in out.splitlines()]

    bare, small, own = figures(minimal, ours)
    rows = [
        ["bare C function with libm", f"{bare[0]:.1f}", "1.00", "", "", ""],
        ["minimal C FMU", f"{small[0]:.1f}", f"{small[0] / bare[0]:.2f}", f"{small[1]:.0e}", "", ""],
        ["HystFMU", f"{own[0]:.1f}", f"{own[0] / bare[0]:.2f}", f"{own[1]:.0e}", *cost],
    ]
    for rival in rivals:
        name = rival.__name__
        place = folder / name
        place.mkdir()
        try:
            path, seconds = rival(place, net)
            bare, _, _, its = figures(minimal, ours, Fmu(path, place / "unpacked").words)
            cost = [f"{1e3 * seconds:.0f} ms", f"{path.stat().st_size / 1000:.0f} kB"]
            rows.append([name, f"{its[0]:.0f}", f"{its[0] / bare[0]:.0f}", f"{its[1]:.0e}", *cost])
        except Skipped as why:
            rows.append([f"{name}: skipped", "", "", "", "", ""])
            print(f"{name} skipped: {why}")
    return rows


def export_rows(folder):
    """P5: cost of the export of an identified model, minimum of ten, reading the binaries anew each time."""
    u = signals.training(150, 1)
    model = fit(Dataset.from_signal(u, u + 0.1 * u**2), "prandtl_ishlinskii")
    rows = []
    for which, fmi in itertools.product(("host",) if platforms.missing() else ("host", "all"), (2, 3)):
        seconds = []
        for _ in range(10):
            platforms._deflated.cache_clear()
            begin = time.perf_counter()
            path = model.export(folder / "model.fmu", fmi, platforms=which)
            seconds.append(time.perf_counter() - begin)
        with zipfile.ZipFile(path) as archive:
            packed = {e.filename: e.compress_size for e in archive.infolist() if e.filename.startswith("binaries/")}
        size = path.stat().st_size
        n = len(platforms.PLATFORMS) if which == "all" else 1
        rows.append([f"FMI {fmi}.0", n, f"{1e3 * min(seconds):.1f}", f"{size / 1000:.0f}"])
        rows[-1] += [f"{(size - sum(packed.values())) / 1000:.0f}", f"{sum(packed.values()) / 1000 / n:.0f}"]
    return rows


def main():
    columns = ["2-12-1 net", "ns/step", "x bare", "max difference", "export", "size"]
    with tempfile.TemporaryDirectory() as where:
        for activation, rivals in (("sigmoid", (pythonfmu,)), ("tanh", ())):
            folder = Path(where) / activation
            folder.mkdir()
            print(f"\nP1 {activation}: setReal(2) + doStep + getReal; target <= 1.0 x bare")
            print(table(columns, steps(activation, rivals, folder)))
        columns = ["export", "platforms", "ms", "kB", "without binaries", "per binary"]
        print("\nP5 export of an identified model; target <= 50 ms, <= 210 kB for this machine, <= 545 kB for all")
        print(table(columns, export_rows(Path(where))))
        for name in platforms.missing():
            print(f"no binary for {name}: 'make platforms' builds it")


if __name__ == "__main__":
    main()
