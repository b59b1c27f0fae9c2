"""What runs in a process of its own, because a panic of the compiler is a BaseException and a solver may hang.

run_model.py --serve                                       simulate a model for each line of input, see `serve`
run_model.py LIBRARY --load CLASS...                       compile classes; one line each: name, tab, complaint
run_model.py COPY --load-changed FILE CLASS FILE CLASS...  compile classes whose file is replaced; one line each
"""

import functools
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import rumoca


def serve() -> None:
    """Simulate a model for each line of input: a JSON list of the arguments of `simulate`.

    An answer is a line too: the complaint, and whether the process ends, as it does after a panic of the compiler.
    Shared are the imports and, for the models of the library, the session: reading the library takes longer than most
    models.  Any other file has a session of its own.
    """
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what the compiler prints is no answer
    for line in sys.stdin:
        complaint, ends = "", False
        try:
            simulate(*json.loads(line))
        except BaseException as e:
            complaint, ends = in_one_line(e), not isinstance(e, Exception)
        print(json.dumps([complaint, ends]), file=answers)
        if ends:
            return


@functools.cache
def session(library: str) -> rumoca.Session:
    return rumoca.Session(roots=[library])


def simulate(
    libraries: str,
    file: str,
    model: str,
    stop: str,
    step: str,
    tolerance: str,
    out: str,
    start: str = "0",
    solver: str = "rk-like",
) -> None:
    roots = libraries.split(os.pathsep) if libraries else []
    own = len(roots) == 1 and Path(file).is_relative_to(roots[0])
    compiled = (session(roots[0]) if own else rumoca.Session(roots=roots)).load(file, model=model)
    rtol = float(tolerance)
    config = rumoca.SimConfig(solver=solver, rtol=rtol, atol=rtol, max_wall_seconds=900.0)
    result = compiled.simulate(t=(float(start), float(stop)), dt=float(step), config=config)
    np.savez(out, allow_pickle=False, time=np.asarray(result.time), **{n: np.asarray(result[n]) for n in result.names})


def load(library: str, *names: str) -> None:
    for name in names:
        file = Path(library).joinpath(*name.split(".")[1:]).with_suffix(".mo")
        complaint = guarded(lambda f=str(file), n=name: session(library).load(f, model=n))
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
        return in_one_line(e)
    return ""


def in_one_line(e: BaseException) -> str:
    return " ".join(f"{type(e).__name__}: {e}".split())


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["--serve"]:
            serve()
        case [where, "--load", *names]:
            load(where, *names)
        case [where, "--load-changed", *pairs]:
            load_changed(where, *pairs)
