"""A simulation that starts at another time gives the same trajectory, shifted by it."""

import re

import compare
import compare_block
import library
import numpy as np
import pytest
import simulate
import twin

STARTS = (1.0, -2.5)  # s, against 0
BOUND = 1e-9  # of the largest value of a trajectory
# they slide along corners inside them: the explicit solver takes 1e5 steps there, whose errors add to 4e-10 to 9e-9, so
# that the implicit one is taken, which refuses the others at this tolerance
SLIDING = (
    "BacklashSum",
    "BoucWenKnee",
    "ConstraintFactor",
    "JilesAtherton",
    "PlayBank",
    "PrandtlIshlinskii",
    "StopBank",
    "ZhaoTan",
)
LONGEST = 2.0**-12  # s, of a step of the explicit solver
# its branch begins with slope 0, so that it takes the root of a rounding of its input: rows of one input are compared,
# which are nearly all at intervals that every start time represents without rounding
ROOT, EXACT = "ZhaoTanInverse", 2.0**-9  # s
# one block of each way to begin; all of them in `make stress`
QUICK = (
    "Pid",
    "NarxNetwork",
    "StateSpace",
    "AdaptiveInverse",
    "Sampled.Creep",
    "Events.PlayBank",
    "Smooth.CreepSteady",
)
# of the solver, whose steps differ with the rounding of the time: at 1e-10 by 1e-8; it refuses 1e-12 to some models
TOLERANCE, TOLERANCE_REFUSED = 1e-12, 1e-11
REFUSED = {*compare_block.HELD, "KrasnoselskiiPokrovskii"}
SHAPES = {f"Sources.{s}" for s in (*twin.SHAPES, "Disturbance")}
OF_TIME_STOP = 4.0  # s; the simulations from each start overlap
SIGNAL = "HystFMU.Validation.BaseClasses.TestSignal"
PACKAGES = "Operators|Inverse|Networks|Dynamics|Plants|Control|Sources|Types|Icons|Functions|Interfaces"


def validations() -> list[str]:
    return [n for n in compare.models() if n.startswith("HystFMU.Validation.")]


def long(name: str) -> bool:
    return name.removeprefix("HystFMU.Validation.") not in QUICK


def shifted(name: str, start: float) -> simulate.Trajectory:
    """A Validation model simulated from another time on, with its inputs moved there; its time counts from the start.

    A source of the library is a function of the time itself, and its trajectory is that of this time.
    """
    own = without_within(library.text(library.classes()[name].file))
    signal = without_within(library.text(library.classes()[SIGNAL].file))
    late = f"(time - ({start!r}))"
    body = "\n".join(re.sub(r"\btime\b", late, text) for text in (equations(signal), equations(own)))
    body = re.sub(rf"(?<![\w.])({PACKAGES})\.", r"HystFMU.\1.", body).replace("BaseClasses.TestSignal", "TestSignal")
    # rumoca 0.10.2 has the relations of time 0 in the initial equations of a simulation from a time before that
    body = re.sub(r"if (\S+ - \S+) < 0.2 then (.*)", r"if noEvent(\1 <= 0) then \2 elseif \1 < 0.2 then \2", body)
    # of samples that begin at -2.5 with steps of 1e-4 it loses one
    body = body.replace("sample(0,", f"sample({start - 0.01!r},")
    short_name = name.rsplit(".", 1)[-1]
    if ".Smooth." in name:  # else the solver steps over corners of |rate|, by 2e-7 at any tolerance
        events, stated = "  Boolean rising = signal.dr > 0;\n", ""
        if short_name == "Duhem":  # a long step errs at a corner by more: 3e-9 to 2e-8
            events += "  discrete Integer steps(start = 0, fixed = true);\n"
            stated = f"  when sample({start!r}, {LONGEST!r}) then\n    steps = pre(steps) + 1;\n  end when;\n"
        body = body.replace("equation\n  connect(", f"{events}equation\n{stated}  connect(", 1)
    body = re.sub(r"\bTs = [\d.e-]+", f"Ts = {EXACT!r}", body) if name.endswith(ROOT) else body
    e = library.experiment(library.classes()[name])
    stop = start + (OF_TIME_STOP if of_time(name) else e["StopTime"])
    settings = (
        stop,
        interval(name),
        TOLERANCE_REFUSED if short_name in REFUSED and "Sampled" not in name else TOLERANCE,
        start,
        "auto" if ".Smooth." in name and short_name in SLIDING else "rk-like",
    )
    found = simulate.solve_text(re.sub(rf"\b(model|end) {short_name}\b", r"\1 Moved", body), *settings).values
    return simulate.Trajectory({**found, "time": found["time"] - start})


def interval(name: str) -> float:
    """Distance of the rows (s)."""
    return EXACT if name.endswith(ROOT) else library.experiment(library.classes()[name])["Interval"]


def of_time(name: str) -> bool:
    """Is the tested block a function of the time itself?"""
    return str(library.classes()[name].tree.symbols["tested"].type) in SHAPES


def without_within(text: str) -> str:
    return re.sub(r"(?m)^(//.*|within .*)\n", "", text)


def equations(text: str) -> str:
    """A class without its descriptions, in which the word time may stand."""
    text = re.sub(r",?\s*Documentation\(info = \"(?:[^\"\\]|\\.)*\"\)", "", text, flags=re.DOTALL)
    return re.sub(r'"(?:[^"\\]|\\.)*"', '""', text)


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.stress) if long(n) else n for n in validations()])
def test_start_time_changes_nothing(name: str) -> None:
    h = interval(name)
    tested = library.find(str(library.classes()[name].tree.symbols["tested"].type), name)
    assert tested is not None
    short_name = name.rsplit(".", 1)[-1]
    # behind an input that is held, rounding may place a jump before or behind a row
    held = short_name in compare_block.HELD
    outputs = ["tested.y"] if held else [f"tested.{p}" for p in library.ports(tested, "RealOutput")]
    first = shifted(name, 0.0).at(h)
    for start in STARTS:
        other = shifted(name, start).at(h)
        late = round(start / h) if of_time(name) else 0
        # not what is inside: the list of extrema holds a loop of a rounding, or not, which no output shows
        ports = [k for k in first if re.sub(r"\[.*", "", k) in outputs]
        assert ports
        for k in ports:
            a, b = first[k][max(late, 0) :], other[k][max(-late, 0) :]
            rows = min(len(a), len(b))
            equal = np.ones(rows, bool)
            if name.endswith(ROOT):
                equal = first["signal.r"][:rows] == other["signal.r"][:rows]
                assert equal.mean() > 0.99
            assert rows >= 49
            far = np.abs(a[:rows] - b[:rows])[equal].max() / max(np.abs(first[k]).max(), 1e-300)
            print(f"{name} from {start}: {k} differs by {far:.1e}")
            assert far <= BOUND, (k, start)
