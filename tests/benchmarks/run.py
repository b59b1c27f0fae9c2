"""Run all benchmarks in turn and print their tables: `make bench`."""

import runpy
from pathlib import Path

for script in sorted(Path(__file__).parent.glob("bench_*.py")):
    print(f"\n== {script.stem.removeprefix('bench_')} ==", flush=True)
    runpy.run_path(str(script), run_name="__main__")
