"""What runs in a process of its own, because a panic of the compiler is a BaseException and a solver may hang.

run_model.py LIBRARIES FILE MODEL STOP STEP TOLERANCE OUT.npz  compile a class, simulate it; folders joined as a path
run_model.py LIBRARY --load CLASS...                           compile classes; one line each: name, tab, complaint
run_model.py COPY --load-changed FILE CLASS FILE CLASS...      compile classes whose file is replaced; one line each
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import rumoca


def simulate(libraries: str, file: str, model: str, stop: str, step: str, tolerance: str, out: str) -> None:
    compiled = rumoca.Session(roots=libraries.split(os.pathsep)).load(file, model=model)
    rtol = float(tolerance)
    config = rumoca.SimConfig(solver="rk-like", rtol=rtol, atol=rtol, max_wall_seconds=60.0)
    result = compiled.simulate(t=(0.0, float(stop)), dt=float(step), config=config)
    np.savez(out, allow_pickle=False, time=np.asarray(result.time), **{n: np.asarray(result[n]) for n in result.names})


def load(library: str, *names: str) -> None:
    session = rumoca.Session(roots=[library])
    for name in names:
        file = Path(library).joinpath(*name.split(".")[1:]).with_suffix(".mo")
        complaint = guarded(lambda f=str(file), n=name: session.load(f, model=n))
        print(name, complaint, sep="\t", flush=True)


def load_changed(library: str, *pairs: str) -> None:
    """Each changed file in turn stands in for the one of its class."""
    for file, name in zip(pairs[::2], pairs[1::2], strict=True):
        place = Path(library).joinpath(*name.split(".")[1:]).with_suffix(".mo")
        sound = place.read_bytes()
        place.write_bytes(Path(file).read_bytes())
        print(guarded(lambda p=str(place), n=name: rumoca.Session(roots=[library]).load(p, model=n)), flush=True)
        place.write_bytes(sound)


def guarded(action: Callable[[], object]) -> str:
    try:
        action()
    except BaseException as e:
        return " ".join(f"{type(e).__name__}: {e}".split())
    return ""


if __name__ == "__main__":
    where, first, *others = sys.argv[1:]
    if first == "--load":
        load(where, *others)
    elif first == "--load-changed":
        load_changed(where, *others)
    else:
        sys.exit(guarded(lambda: simulate(where, first, *others)) or 0)
