"""Untrusted files: every reader accepts a mutated file or raises a one-line InputError, in bounded time and memory."""

import gzip
import io
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import FrameType
from typing import NoReturn

import h5py
import lab_files
import numpy as np
import pytest
from embedded import graphs
from scipy.io import savemat

from hystfmu import InputError, Model, read
from hystfmu.base.confine import Box, confine
from hystfmu.data.reader import arrays
from hystfmu.data.reader.formats import PARSERS, serve
from hystfmu.fmu import export_fmu
from hystfmu.scenario import Cases
from hystfmu.scenario.outcome.result import Baseline
from hystfmu.scenario.ssp.read import read_ssp
from hystfmu.scenario.ssp.write import write_ssp
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import build
from hystfmu.studies.spec import Study

ROOT = Path(__file__).parents[2]
# limits per file: processor time beyond that of the valid file, and wall time for waiting
SECONDS, WAITING = 1.0, 100.0
MEGABYTES = 200  # limit for a whole run of one reader

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs signals and resource limits")


def text_words() -> list[bytes]:
    words = (
        "nan inf -inf 1e999 -1 0 1e-320 99999999999999999999 0x10 1_000 1,5 true false null '' [] {} [[]] = \" ''' # ,"
    )
    more = [
        "\x00",
        "\ufeff",
        "ä",
        "\u0661",
        "..",
        "../../etc/passwd",
        "\r",
        "\r\n",
        "\n\n",
        "\t",
        ";" * 9,
        "[" * 3000,
        "9" * 5000,
    ]
    return [w.encode() for w in [*words.split(" "), *more]]


XML_WORDS = [
    b'<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]>',
    b'<!DOCTYPE a [<!ENTITY b "'
    + b"x" * 999
    + b'">'
    + b'<!ENTITY c "'
    + b"&b;" * 999
    + b'"><!ENTITY d "'
    + b"&c;" * 999
    + b'">]>',
    b"&d;",
    b"&b;",
    b"<a>" * 2000,
    b'"" ""',
    b'valueReference="4294967296"',
    b'<Dimension start="9999999999"/>',
    b"</ModelVariables>",
]


def mutate(content: bytes, rng: random.Random, words: list[bytes]) -> bytes:
    """Apply one to four random changes."""
    data = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        at, other = (rng.randrange(len(data) + 1) for _ in range(2))
        n = rng.choice([1, 2, 8, 40, 400])
        kind = rng.randrange(7)
        if kind == 0 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del data[at : at + n]
        elif kind == 2:
            data[at:at] = rng.choice(words)
        elif kind == 3:
            data[at : at + n] = rng.choice(words)
        elif kind == 4:
            data[at:at] = data[other : other + n]
        elif kind == 5:
            del data[at:]
        else:  # duplicate a line elsewhere
            lines = bytes(data).split(b"\n")
            lines.insert(rng.randrange(len(lines) + 1), rng.choice(lines))
            data = bytearray(b"\n".join(lines))
    return bytes(data)


def mutate_archive(content: bytes, rng: random.Random) -> bytes:
    """Change the bytes of an archive, a file in it, or the name of a file."""
    if rng.random() < 0.3:
        return mutate(content, rng, [b"PK\x05\x06", b"\xff" * 8, b"\x00" * 8])
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        names = old.namelist()
        chosen = rng.choice([n for n in names if n.endswith((".xml", ".ssd", ".ssv", ".csv", ".bin", ".fmu"))])
        for name in names:
            inner = old.read(name)
            if name == chosen:
                inner = (
                    mutate_archive(inner, rng)
                    if name.endswith(".fmu")
                    else mutate(inner, rng, text_words() + XML_WORDS)
                )
                if rng.random() < 0.05:
                    name = rng.choice(["../" + name, "/" + name, name + "/x", "a" * 300, name.upper(), "C:" + name])
            new.writestr(name, inner)
            if rng.random() < 0.005:
                new.writestr("zeros", bytes(50 * 2**20))
    return out.getvalue()


# ---- readers: a valid file, and the function that reads it ---------------------------------------------------------
def csv_file(folder: Path) -> Path:
    t = np.arange(60) * 0.01
    lines = ["t [s];u [V];y [um]", *(f"{a:.17g};{np.sin(9 * a):.17g};{np.cos(7 * a):.17g}" for a in t)]
    (folder / "data.csv").write_text("\n".join(lines))
    return folder / "data.csv"


def gzip_file(folder: Path) -> Path:
    (folder / "data.csv.gz").write_bytes(gzip.compress(csv_file(folder).read_bytes()))
    return folder / "data.csv.gz"


def german_file(folder: Path) -> Path:
    rows = [f'{k * 0.5:.1f};"{np.sin(k / 5):.6g}";{np.cos(k / 7):.6g};'.replace(".", ",") for k in range(60)]
    head = ["Messung;3", "", "# Stapel", "Zeit;Spannung;Weg;", "ms;V;µm;"]
    (folder / "data.txt").write_bytes("\r\n".join([*head, *rows]).encode("cp1252"))
    return folder / "data.txt"


def matlab_file(folder: Path, packed: bool = False) -> Path:
    t = np.arange(60) * 0.01
    columns = {"t": t, "u": np.sin(9 * t), "y": np.cos(7 * t)}
    savemat(folder / "data.mat", {**columns, "run": {"t": t}, "label": "stack"}, do_compression=packed)
    return folder / "data.mat"


def matlab_7_3_file(folder: Path) -> Path:
    t = np.arange(60) * 0.01
    with h5py.File(folder / "data.mat", "w", userblock_size=512) as file:
        for name, column in (("t", t), ("u", np.sin(9 * t)), ("y", np.cos(7 * t))):
            file.create_dataset(name, data=column[None]).attrs["MATLAB_class"] = np.bytes_("double")
    with open(folder / "data.mat", "r+b") as head:
        head.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    return folder / "data.mat"


def hdf5_file(folder: Path) -> Path:
    t = np.arange(60) * 0.01
    with h5py.File(folder / "data.h5", "w") as file:
        for name, column in (("t", t), ("u", np.sin(9 * t)), ("y", np.cos(7 * t))):
            file.create_dataset(f"run/{name}", data=column, compression="gzip")
    return folder / "data.h5"


def model_file(folder: Path) -> Path:
    Model("prandtl_ishlinskii", graphs()["loop"], 1e-3).save(folder / "m.model.toml")
    return folder / "m.model.toml"


def scenario_file(folder: Path) -> Path:
    for name in ("loops", "pid", "models"):
        shutil.copytree(ROOT / "scenarios" / name, folder / name)
    return folder / "pid" / "scenario.toml"


def extended_file(folder: Path) -> Path:
    scenario_file(folder)
    return folder / "loops" / "feedback.toml"


def baseline_file(folder: Path) -> Path:
    return scenario_file(folder).with_name("baseline.csv")


def study_file(folder: Path) -> Path:
    scenario_file(folder)
    return folder / "pid" / "draws.study.toml"


def fmu_file(folder: Path) -> Path:
    return export_fmu(graphs()["loop"], folder / "loop.fmu", 2)


def fmu3_file(folder: Path) -> Path:
    return export_fmu(graphs()["mixed"], folder / "mixed.fmu", 3)


def ssp_file(folder: Path) -> Path:
    return write_ssp(Cases(scenario_file(folder)).cases[0], folder / "pid.ssp", separate=True).path


def read_scenario(path: Path) -> None:
    for case in Cases(path).cases:
        build(case)


OF_LABS = ("dSPACE", "xlsx", "npz", "parquet", "feather", "TDMS")
READERS: dict[str, tuple[Callable[[Path], Path], Callable[[Path], object]]] = {
    "csv": (csv_file, read), "german": (german_file, read), "gzip": (gzip_file, read), "matlab": (matlab_file, read),
    "packed matlab": (partial(matlab_file, packed=True), read), "matlab 7.3": (matlab_7_3_file, read),
    "hdf5": (hdf5_file, read), **{kind: (partial(lab_files.write, kind=kind), read) for kind in OF_LABS},
    "model": (model_file, Model.load), "scenario": (scenario_file, read_scenario),
    "extended": (extended_file, lambda p: read_scenario(p.parents[1] / "pid")),
    "baseline": (baseline_file, lambda p: Baseline.load(p.parent)), "study": (study_file, Study),
    "fmu": (fmu_file, Foreign.load), "fmu3": (fmu3_file, Foreign.load), "ssp": (ssp_file, read_ssp),
}  # fmt: skip


class TooLong(Exception):
    pass


def verdict(read: Callable[[Path], object], path: Path, seconds: float = SECONDS) -> str:
    """Return "" for an accepted file, "refused" for a one-line error, else the defect of the reader.

    `seconds` limits the processor time.
    """

    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise TooLong

    limits = {signal.ITIMER_PROF: (signal.SIGPROF, seconds), signal.ITIMER_REAL: (signal.SIGALRM, WAITING)}
    for timer, (number, limit) in limits.items():
        signal.signal(number, stop)
        signal.setitimer(timer, limit)
    try:
        read(path)
        return ""
    except InputError as e:
        return "refused" if str(e).strip() and "\n" not in str(e) else f"the message is not one line: {str(e)!r}"
    except TooLong:
        return f"more than {seconds:.1f} s of work, or {WAITING} s of waiting"
    except Exception as e:
        return f"{type(e).__name__}: {e}"[:300]
    finally:
        for timer in limits:
            signal.setitimer(timer, 0)


def peak(reset: bool = False) -> float:
    """Return the peak memory of this process (MB), on Linux since the last reset."""
    marks = Path("/proc/self/clear_refs")
    if not marks.exists():
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    if reset:
        marks.write_text("5")
    held = next(s for s in Path("/proc/self/status").read_text().splitlines() if s.startswith("VmHWM"))
    return int(held.split()[1]) / 1024


def run(name: str, folder: Path, times: int, monkeypatch: pytest.MonkeyPatch) -> tuple[int, float, float]:
    """Return the number of refused files, the longest processor time (s) and the memory growth (MB)."""
    make, read = READERS[name]
    inside = folder / "inside"
    inside.mkdir()
    path = make(inside)
    good = path.read_bytes()
    begin = time.process_time()
    assert verdict(read, path, WAITING) == ""
    limit = SECONDS + time.process_time() - begin
    before = peak(reset=True)
    refused, longest, wrong = 0, 0.0, []
    for k in range(times):
        monkeypatch.setenv("HYSTFMU_CACHE", str(folder / "cache"))
        rng = random.Random(f"{name} {k}")
        archive = path.suffix in (".fmu", ".ssp")
        path.write_bytes(mutate_archive(good, rng) if archive else mutate(good, rng, text_words()))
        begin = time.process_time()
        found = verdict(read, path, limit)
        longest = max(longest, time.process_time() - begin)
        refused += found == "refused"
        if found not in ("", "refused"):
            (folder / f"{name}-{k}{path.suffix}").write_bytes(path.read_bytes())
            wrong.append(f"{name} {k}: {found}")
        shutil.rmtree(folder / "cache", ignore_errors=True)
    assert wrong == []
    grown = peak() - before
    assert grown < MEGABYTES
    assert {p.name for p in folder.iterdir()} == {"inside"}  # nothing was written outside
    return refused, longest, grown


class Forked:
    """A `Child` that is forked from this process, which has loaded numpy and h5py: a tenth of the time of a new one.

    It confines itself and runs the parser as the new one does, so that what the parser does to a file is the same.
    """

    def __init__(self, script: str, parser: str, *words: str, box: Box, told: bool) -> None:
        assert not told
        self._parser = PARSERS[parser]
        sys.stdout.flush()
        sys.stderr.flush()
        self._said = tempfile.TemporaryFile()  # noqa: SIM115
        self._pid = os.fork()
        if not self._pid:
            self._be(words, box)

    def _be(self, words: tuple[str, ...], box: Box) -> NoReturn:
        status = 1
        try:
            for timer in (signal.ITIMER_PROF, signal.ITIMER_REAL):
                signal.setitimer(timer, 0)
            os.dup2(self._said.fileno(), 1)
            os.dup2(self._said.fileno(), 2)
            confine(box)
            serve(self._parser, words)
            status = 0
        except BaseException as e:
            os.write(2, f"{type(e).__name__}: {e}\n".encode())
        finally:
            os._exit(status)

    def finish(self, seconds: float) -> tuple[list[str], bool]:
        end = time.monotonic() + seconds
        ended, status = os.waitpid(self._pid, os.WNOHANG)
        while not ended and time.monotonic() < end:
            time.sleep(1e-3)
            ended, status = os.waitpid(self._pid, os.WNOHANG)
        if not ended:
            os.kill(self._pid, signal.SIGKILL)
            status = os.waitpid(self._pid, 0)[1]
        self.status = os.waitstatus_to_exitcode(status)
        self.ending = f"ended with status {self.status}"
        self._said.seek(0)
        with self._said:
            return self._said.read().decode(errors="replace").splitlines(), bool(ended)


IN_A_PROCESS = ("hdf5", "matlab", "packed matlab", "matlab 7.3", *OF_LABS)  # each file takes a process
SOME = [pytest.param(name, marks=pytest.mark.stress) if name == "ssp" else name for name in READERS]


@pytest.mark.some(1)
@pytest.mark.parametrize("name", SOME)
def test_some_mutated_files(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times = 8 if name in IN_A_PROCESS else 12 if name == "ssp" else 40
    assert run(name, tmp_path, times, monkeypatch)[0] > 1


@pytest.mark.stress
@pytest.mark.parametrize("name", READERS)
def test_many_mutated_files(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    times = 1000 if name in ("fmu", "fmu3", "ssp", *IN_A_PROCESS) else 5000
    monkeypatch.setattr(arrays, "Child", Forked)
    refused, longest, grown = run(name, tmp_path, times, monkeypatch)
    with capsys.disabled():
        print(
            f"\n{name}: {times} mutated files, {refused} refused with one line; {longest:.2f} s, {grown:.0f} MB at most"
        )


@pytest.mark.parametrize(("name", "content"), [
    ("data.csv", b"t,u\r,y\n0,1,2\n1,2,3\n"), ("m.model.toml", b"a = " + b"[" * 5000),
    ("m.model.toml", b"a = " + b"9" * 5000), ("m.model.toml", b"a = \xff"), ("baseline.csv", b"case,t,u\rv\n"),
    ("baseline.csv", b"case,t,u\na,0,\xff\n"),
])  # fmt: skip
def test_findings_of_the_stress_test(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / "baseline.toml").write_text("")
    (tmp_path / name).write_bytes(content)
    reader = {"data.csv": read, "m.model.toml": Model.load, "baseline.csv": READERS["baseline"][1]}[name]
    assert verdict(reader, tmp_path / name) == "refused"


def test_a_model_with_an_integer_that_no_float_holds(tmp_path: Path) -> None:
    path = model_file(tmp_path)
    path.write_text(path.read_text().replace("levels = [1.0", "levels = [" + "9" * 400))
    assert verdict(Model.load, path) == "refused"


@pytest.mark.parametrize("encoding", ["UF-8", "utf-32", "shift_jis", "cp65001", "idna"])
def test_xml_in_an_unsupported_encoding(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "a.ssp"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", f'<?xml version="1.0" encoding="{encoding}"?>\n<a/>')
    assert verdict(read_ssp, path) == "refused"
