"""The core in a page: built from these sources, no imports, small, on the vectors of every block the native bits."""

import base64
import gzip
import hashlib
import importlib.util
import subprocess
import sys
import time
import tomllib
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from opened_page import Browser, Page

import hystfmu as hy
from hystfmu.core.library import block_types
from hystfmu.graph import Graph, Node
from hystfmu.report.explorer import CORE as FILE
from hystfmu.report.explorer import packed_core

ROOT = Path(__file__).parents[2]
BUILD = (sys.executable, ROOT / "fmu_build" / "platforms" / "page.py", ROOT / "fmu_build")
CORE = zlib.decompress(base64.b64decode(packed_core()), -15)
VECTORS = sorted((ROOT / "tests" / "vectors").glob("*/*.toml"))
MOST_GZIP, MOST_SLOWER = 60_000, 2.0  # P13
RUN = """
async ([core, cases]) => {
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const text = a => btoa(Array.from(a, v => String.fromCharCode(v)).join(''));
  const module = await WebAssembly.compile(bytes(core)), c = (await WebAssembly.instantiate(module, {})).exports;
  const put = a => {
    const at = c.room(a.length);
    new Uint8Array(c.memory.buffer, at, a.length).set(a);
    return at;
  };
  const outputs = cases.map(({file, u, rows, numbers, t0, h, times}) => {
    const content = bytes(file), g = c.open(put(content), content.length);
    const input = put(bytes(u)), y = c.room(8 * numbers);
    if (!g) return 'refused';
    const taken = [];
    let status = 0;
    for (let k = 0; k < times; k++) {
      const begin = performance.now();
      status = c.run(g, rows, t0, h, input, y);
      taken.push(performance.now() - begin);
    }
    const made = times > 1 ? '' : text(new Uint8Array(c.memory.buffer, y, 8 * numbers));
    return {status, seconds: Math.min(...taken) / 1000, y: made};
  });
  return {imports: WebAssembly.Module.imports(module).length, outputs};
}
"""


def case(graph: Graph, u: np.ndarray, rows: int, t0: float, h: float, times: int = 1) -> dict[str, Any]:
    """One run as the page takes it."""
    numbers = rows * sum(p.size for p in graph.ports if p.kind == "output")
    packed = [base64.b64encode(b).decode() for b in (graph.to_bytes(), u.astype("<f8").tobytes())]
    named = dict(zip(("file", "u"), packed, strict=True))
    return {**named, "rows": rows, "numbers": numbers, "t0": t0, "h": h, "times": times}


@pytest.fixture(scope="module")
def blank(browser: Browser) -> Page:
    return browser.new_page()


def test_it_belongs_to_the_sources(tmp_path: Path) -> None:
    """Without a compiler: an edit of C is told here, before any page is opened."""
    fresh = subprocess.run([*BUILD, FILE, "--check"]).returncode == 0
    assert fresh, f"{FILE.name} is of other C sources: run 'make generate'"
    assert FILE.read_text().splitlines()[1] == f"{len(CORE)} bytes, SHA-256 {hashlib.sha256(CORE).hexdigest()}"
    other = tmp_path / "other.txt"
    other.write_text(FILE.read_text().replace("Sources: ", "Sources: 0", 1))
    assert subprocess.run([*BUILD, other, "--check"]).returncode == 1


@pytest.mark.stress
def test_a_fresh_build_gives_its_bytes(tmp_path: Path) -> None:
    if importlib.util.find_spec("ziglang") is None or importlib.util.find_spec("zopfli") is None:
        pytest.skip("ziglang or zopfli is not installed: no compiler for pages")
    subprocess.run([*BUILD, tmp_path / "core.txt"], check=True)
    fresh, there = ((p.read_text().splitlines()) for p in (tmp_path / "core.txt", FILE))
    assert fresh[:2] == there[:2]
    assert zlib.decompress(base64.b64decode("".join(fresh[2:])), -15) == CORE


def test_it_is_small(capsys: pytest.CaptureFixture[str]) -> None:
    packed = len(gzip.compress(CORE, 9))
    with capsys.disabled():
        print(f"\ncore for pages: {len(CORE)} bytes, {packed} as gzip")
    assert packed <= MOST_GZIP


def test_the_vectors_of_every_block_give_the_bits_of_the_native_core(blank: Page) -> None:
    cases, expected, names = [], [], []
    for file in VECTORS:
        for k, v in enumerate(tomllib.loads(file.read_text())["case"]):
            graph = Graph.single(Node(file.stem, file.stem, v.get("dims", {}), v.get("values", {})))
            u = np.asarray(v["u"], dtype=float).reshape(len(v["y"]), graph.n_inputs)
            h, t0 = v.get("h", 1.0), v.get("t0", 0.0)
            names.append(f"{file.stem}-{k}")
            expected.append(graph.run(u, h, t0).astype("<f8").tobytes())
            cases.append(case(graph, u, len(u), t0, h))
    got = blank.evaluate(RUN, [base64.b64encode(CORE).decode(), cases])
    assert got["imports"] == 0
    different = [n for n, y, found in zip(names, expected, got["outputs"], strict=True) if _bytes(found) != y]
    assert different == []
    assert {n.split("-")[0] for n in names} == set(block_types())


def _bytes(found: Any) -> bytes:
    return b"" if found == "refused" or found["status"] else base64.b64decode(found["y"])


@pytest.mark.stress
def test_a_step_takes_at_most_twice_the_native_time(blank: Page, capsys: pytest.CaptureFixture[str]) -> None:
    """P13, in one run: of many short runs the fastest, which no other program interrupts."""
    data, n, times = hy.synthetic.piezo(60, 1000.0), 20_000, 200
    k = np.arange(n)
    u = 50 - 50 * np.cos(2 * np.pi * k / 400) * np.exp(-k / n)
    lines, slow = [], []
    for key in ("prandtl_ishlinskii", "zhao_tan_mlp", "preisach", "actuator"):
        model = hy.fit(data, key)
        native = min(_seconds(model, u) for _ in range(times)) / n
        packed = [base64.b64encode(CORE).decode(), [case(model.graph, u, n, 0.0, 1e-3, times)]]
        rounds = [blank.evaluate(RUN, packed)["outputs"][0]["seconds"] for _ in range(3)]
        page = min(rounds) / n  # the clock of a page has steps of 0.1 ms
        lines.append(f"  {key:20s} native {1e9 * native:5.0f} ns, page {1e9 * page:5.0f}: {page / native:.2f}")
        slow += [key] if page > MOST_SLOWER * native else []
    with capsys.disabled():
        print("\na step:\n" + "\n".join(lines))
    assert slow == []


def _seconds(model: hy.Model, u: np.ndarray) -> float:
    begin = time.perf_counter()
    model.predict(u, 1e-3)
    return time.perf_counter() - begin
