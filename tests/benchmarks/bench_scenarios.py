"""P2, P6, P8: a closed loop of two units and studies of it, compared with other ways to run the same two FMUs.

The loop has a P controller and a first-order plant and runs 10 000 steps of 1 ms.  P2 is the minimal processor time of
repeats in turns, which reduces the influence of other programs.  A study is measured in wall time on one core and on
two, in turns; the load is printed too, because two workers need two free cores.
"""

import contextlib
import ctypes
import itertools
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
import zipfile
from collections import deque
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "scenarios"))

import fmpy
import numpy as np
import tomli_w

import hystfmu as hy
from hystfmu.fmu.write.export import export_fmu
from hystfmu.report.terminal import table
from hystfmu.scenario import Cases, build, simulate
from hystfmu.scenario.engine.member import FmuStore
from hystfmu.scenario.engine.native import Native
from papers.study_speed import GAIN, LAG, LOOP, STEPS, H, by_hand

HERE = Path(__file__).resolve().parent


def least(run, repeats):
    """Return the minimal processor time of repeated calls (s)."""
    return min(timed(run) for _ in range(repeats))


def timed(run):
    """Return the processor time of a call (s)."""
    begin = time.process_time()
    run()
    return time.process_time() - begin


def system(folder, data, coupling=None):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scenario.toml").write_text(tomli_w.dumps(data))
    return build(Cases(folder, coupling=coupling).cases[0])


class Rivals:
    """Other masters for the two exported FMUs; each run returns its time (s) and y at every step."""

    def __init__(self, of, folder):
        self.folder, self.paths = folder, {}
        for part in of.parts:
            self.paths[part.name] = export_fmu(part.own, folder / f"{part.name}.fmu", fmi=2)
        library = folder / "master.so"
        headers = ["-isystem", str(Path(fmpy.__file__).parent / "c-code")]
        words = ["cc", "-std=gnu99", "-O3", *headers, HERE / "scenario_master.c", "-o", library, "-shared", "-fPIC"]
        subprocess.run([*words, "-ldl"], check=True)
        self.c = ctypes.CDLL(str(library))
        self.c.bare.restype = self.c.container.restype = ctypes.c_double
        self.unpacked = {name: fmpy.extract(str(path), str(folder / name)) for name, path in self.paths.items()}
        self.descriptions = {n: fmpy.read_model_description(f, validate=False) for n, f in self.unpacked.items()}

    def reference(self, unit, name):
        return next(v.valueReference for v in self.descriptions[unit].modelVariables if v.name == name)

    def bare(self):
        y = np.empty(STEPS + 1)
        a, k = ctypes.c_double(math.exp(-H / LAG)), ctypes.c_double(GAIN)
        return self.c.bare(STEPS, a, k, y.ctypes.data_as(ctypes.c_void_p)), y

    def by_hand(self, n=STEPS):
        """Run the loop as usually written by hand with fmpy."""
        return by_hand({name: (self.unpacked[name], d) for name, d in self.descriptions.items()}, n)

    def container(self):
        """Run a container of fmu-manipulation-toolbox with its sequential order, built once."""
        archive = self.folder / "loop.fmu"
        if not archive.exists():
            units = {"fmu": ["plant.fmu", "controller.fmu"], "step_size": H, "name": "loop.fmu", "sequential": True}
            units |= {"auto_link": False, "auto_input": False, "auto_output": False}
            units["link"] = [["controller.fmu", "y", "plant.fmu", "u"], ["plant.fmu", "y", "controller.fmu", "u_2"]]
            units["output"] = [["plant.fmu", "y", "y"]]
            units["start"] = [["controller.fmu", "u_1", "1.0"]]
            (self.folder / "loop.json").write_text(json.dumps(units))
            script = "from fmu_manipulation_toolbox.cli.fmucontainer import fmucontainer; fmucontainer()"
            words = [sys.executable, "-c", script, "-container", "loop.json", "-fmu-directory", self.folder]
            done = subprocess.run(words, cwd=self.folder, capture_output=True, text=True)
            if not archive.exists():
                raise RuntimeError(" ".join((done.stdout + done.stderr).split())[-200:])
            with zipfile.ZipFile(archive) as f:
                f.extractall(self.folder / "loop")
        d = fmpy.read_model_description(str(self.folder / "loop"), validate=False)
        (output,) = (v.valueReference for v in d.modelVariables if v.name == "y")
        name, y = d.coSimulation.modelIdentifier, np.empty(STEPS + 1)
        library = self.folder / "loop" / "binaries" / "linux64" / f"{name}.so"
        words = [str(library).encode(), d.guid.encode(), (self.folder / "loop" / "resources").as_uri().encode()]
        at = y.ctypes.data_as(ctypes.c_void_p)
        seconds = self.c.container(*words, ctypes.c_uint(output), STEPS, ctypes.c_double(H), at)
        if seconds < 0:
            raise RuntimeError("the container does not run")
        return seconds, y

    def libcosim(self):
        """Run the fixed-step algorithm of libcosim with all steps in one call."""
        from libcosimpy.CosimExecution import CosimExecution
        from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
        from libcosimpy.CosimObserver import CosimObserver
        from libcosimpy.CosimSlave import CosimLocalSlave

        log_output_level(CosimLogLevel.ERROR)
        run = CosimExecution.from_step_size(round(1e9 * H))
        slaves = {}
        for name in ("plant", "controller"):
            slave = CosimLocalSlave(fmu_path=str(self.paths[name]), instance_name=name)
            slaves[name] = run.add_local_slave(slave)
        run.real_initial_value(slaves["controller"], self.reference("controller", "u_1"), 1.0)
        for a, out, b, to in (("controller", "y", "plant", "u"), ("plant", "y", "controller", "u_2")):
            run.connect_real_variables(slaves[a], self.reference(a, out), slaves[b], self.reference(b, to))
        observer = CosimObserver.create_last_value()
        run.add_observer(observer)
        begin = time.process_time()
        if not run.step(STEPS):
            raise RuntimeError("libcosim stopped")
        seconds = time.process_time() - begin
        return seconds, np.array(observer.last_real_values(slaves["plant"], [self.reference("plant", "y")]))


def engines(folder):
    """Measure and print P2."""
    loop, jacobi = system(folder / "loop", LOOP), system(folder / "jacobi", LOOP, "jacobi")
    rivals = Rivals(loop, folder)
    native = Native(loop, ["plant.y"])
    want, jacobi_too = native.run()["plant.y"], Native(jacobi, ["plant.y"]).run()["plant.y"]
    short = replace(loop, case=replace(loop.case, stop=H))
    runs = {
        "bare C master": (rivals.bare, 10, ""),
        "native engine": (lambda: (timed(native.run), want), 10, "<= 0.03"),
        "fmpy engine": (lambda: (timed(lambda: simulate(loop, "fmpy", store)), y), 2, "<= 1.6"),
        "container, stepped from C": (rivals.container, 1, ""),
        "libcosim": (rivals.libcosim, 1, ""),
        "fmpy hand loop": (rivals.by_hand, 1, ""),
    }
    seconds, off, why = dict.fromkeys(runs, math.inf), {}, {}
    with FmuStore() as store:
        y = simulate(loop, "fmpy", store)["plant.y"]
        start = least(lambda: simulate(short, "fmpy", store), 20)
        for _ in range(10):
            for name, (run, times, _) in runs.items():
                if name in why:
                    continue
                try:
                    done = [run() for _ in range(times)]
                except Exception as e:  # a tool that is missing or fails is skipped
                    why[name] = f"{name}: skipped ({type(e).__name__}: {' '.join(str(e).split())[:80]})"
                else:
                    seconds[name] = min(seconds[name], *(d[0] for d in done))
                    got = done[0][1]
                    off[name] = min(np.abs(got - w[-len(got) :]).max() for w in (want, jacobi_too))
    seconds["fmpy engine"] -= start
    rows = []
    for name, (_, _, target) in runs.items():
        us, ratio = 1e6 * seconds[name] / STEPS, seconds["fmpy hand loop"] / seconds[name]
        rows.append(
            [why[name], "", "", "", ""]
            if name in why
            else [name, f"{us:.3f}", f"{ratio:.1f}", f"{off[name]:.0e}", target]
        )
    print(f"\nP2: P controller and first-order plant, {STEPS} steps; without start-up")
    print(table(["", "us/step", "hand loop / it", "difference", "target"], rows))
    print(f"start-up of the fmpy engine: {1e3 * start:.1f} ms for two FMUs, most of it in fmpy")
    return rivals


def studies(folder, rivals):
    """P6: 1000 variations of the loop on one core and on two.

    Wall and processor time are printed: on a machine with other load, the processor time is more reliable.
    """
    n, cores = 1000, sorted(os.sched_getaffinity(0))
    text = {"name": "p6", "scenario": "../p2", "method": "sobol", "n": n}
    text["parameters"] = {"controller.k": {"scale": [0.5, 2.0]}, "plant.b": {"scale": [0.5, 2.0]}}
    path = folder / "studies" / "study.toml"
    path.parent.mkdir(exist_ok=True)
    path.write_text(tomli_w.dumps(text))
    system(folder / "p2", LOOP)

    def study(n_cores, k):
        os.sched_setaffinity(0, cores[:n_cores])
        try:
            begin, before = time.perf_counter(), used()
            assert not hy.study(path, folder / f"out_{n_cores}_{k}").failed
            return time.perf_counter() - begin, used() - before
        finally:
            os.sched_setaffinity(0, cores)

    hand = min(rivals.by_hand()[0] for _ in range(5)) * n
    load, counts = os.getloadavg()[0], [1, 2][: len(cores)]
    for c in counts:
        study(c, "first")  # imports
    done = {c: [] for c in counts}
    for k in range(8):
        for c in counts:
            done[c].append(study(c, k))
    best = {c: [min(x) for x in zip(*done[c], strict=True)] for c in counts}
    rows = [["fmpy hand loop, one process", f"{hand:.1f}", f"{hand:.1f}", "1", ""]]
    for c, target in zip(counts, (">= 100 x the hand loop", ">= 1.8 x one core"), strict=False):
        whole, processor = best[c]
        rows.append([f"study, cores: {c}", f"{whole:.3f}", f"{processor:.3f}", f"{hand / whole:.0f}", target])
    print(f"\nP6: {n} variations of {STEPS} steps; the hand loop is extrapolated from the best of 5 of them")
    print(table(["", "s", "s of processor", "hand loop / it", "target"], rows))
    if len(counts) > 1:
        (one, _), (two, _) = best[1], best[2]
        pairs = sorted(a[0] / b[0] for a, b in zip(done[1], done[2], strict=True))
        print(f"2 cores / 1: {one / two:.2f} x by the best of each, {pairs[0]:.2f} to {pairs[-1]:.2f} x in turns")
    print(f"load before the studies {load:.1f} on {os.cpu_count()} cores; two workers need two free cores")


def used():
    """Return the processor time of this process and its finished children (s)."""
    own, children = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime


def chain(n_units):
    """Return a scenario of first-order lags in series."""
    lag = {"block": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": {"b": [1.0], "a": [LAG, 1.0]}}
    names = [f"lag_{k}" for k in range(n_units)]
    wires = {f"{b}.u": f"{a}.y" for a, b in itertools.pairwise(names)}
    units = {k: dict(lag) for k in names}
    units["lag_0"]["inputs"] = {"u": 1.0}
    metrics = {"peak": {"kind": "peak", "signal": f"{names[-1]}.y"}}
    return {**LOOP, "stop": 1000 * H, "order": names, "units": units, "connections": wires, "metrics": metrics}


RUN = """
import sys, time
from pathlib import Path
import hystfmu as hy
begin = time.process_time()
hy.run([sys.argv[1]], engine="native", report=sys.argv[2])
seconds = time.process_time() - begin
# ru_maxrss would include the memory of the parent process
lines = Path("/proc/self/status").read_text().splitlines() if Path("/proc").exists() else []
print(seconds, *(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM")))
"""


def whole_run(folder, data):
    """Return processor time (s) and peak memory (MB) of a process that runs a scenario with metrics and report."""
    system(folder, data)
    words = [sys.executable, "-c", RUN, str(folder), str(folder / "report")]
    done = subprocess.run(words, check=True, capture_output=True, text=True)
    seconds, memory = [float(x) for x in [*done.stdout.split(), "nan"]][:2]
    return seconds, memory


def growth(folder):
    """P8: time per step, per unit and step, and per variation; memory of a whole run."""
    rows = []
    for steps in (10_000, 100_000, 1_000_000, 10_000_000):
        data = {**LOOP, "stop": steps * H}
        native, name = Native(system(folder / f"steps_{steps}", data), ["plant.y"]), f"{steps} steps of the loop"
        ns = 1e9 * least(lambda native=native: deque(native.chunks(), 0), max(2, min(20, 10_000_000 // steps))) / steps
        seconds, memory = whole_run(folder / f"run_{steps}", data)
        rows.append([name, f"{ns:.1f} ns a step", f"{seconds:.2f} s", f"{memory:.0f} MB"])
    for units in (20, 200):
        data = chain(units)
        native = Native(system(folder / f"units_{units}", data), [f"lag_{units - 1}.y"])
        ns = 1e9 * least(native.run, 40) / 1000 / units
        seconds, memory = whole_run(folder / f"chain_{units}", data)
        name = f"{units} lags in a row, 1000 steps"
        rows.append([name, f"{ns:.1f} ns a step and unit", f"{seconds:.2f} s", f"{memory:.0f} MB"])
    native = Native(system(folder / "variations", LOOP), ["plant.y"])
    for n in (10, 100, 1000):

        def vary(n=n):
            for k in range(n):
                native.set({"controller.k_1": 1 + k / n})
                native.run()

        rows.append([f"{n} variations of the loop", f"{1e3 * least(vary, 3) / n:.3f} ms a variation", "", ""])
    print("\nP8: cost in the native engine; must not grow within a group of rows")
    print(table(["", "engine", "`run` with report", "peak memory"], rows))


def main():
    with tempfile.TemporaryDirectory() as where, contextlib.chdir(where):
        folder = Path(where)
        studies(folder, engines(folder))
        growth(folder)


if __name__ == "__main__":
    main()
