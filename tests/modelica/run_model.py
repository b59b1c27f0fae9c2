"""Compile one class with rumoca and simulate it: `run_model.py LIBRARY FILE MODEL [STOP STEP TOLERANCE OUT.npz]`.

A process of its own, because a panic of the compiler is a BaseException and a hanging solver must be killed.
"""

import sys

import numpy as np
import rumoca


def main(library: str, file: str, model: str, *run: str) -> None:
    compiled = rumoca.Session(roots=[library]).load(file, model=model)
    if not run:
        return
    stop, step, tolerance, out = run
    rtol = float(tolerance)
    config = rumoca.SimConfig(solver="rk-like", rtol=rtol, atol=rtol, max_wall_seconds=60.0)
    result = compiled.simulate(t=(0.0, float(stop)), dt=float(step), config=config)
    np.savez(out, allow_pickle=False, time=np.asarray(result.time), **{n: np.asarray(result[n]) for n in result.names})


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except BaseException as e:
        sys.exit(f"{type(e).__name__}: {e}")
