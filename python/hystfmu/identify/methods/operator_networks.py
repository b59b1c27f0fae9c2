"""Networks whose inputs are the input u and the outputs of hysteresis operators, which represent the memory.

play_bank_mlp        The further inputs are the outputs of a bank of plays, which represent the whole return-point
                     memory. In the other kinds, two inputs of the network do not determine the output, because the
                     one-to-one theorem of Zhao & Tan 2008 has counterexamples. The outputs of a bank of plays determine
                     the output up to the resolution of the bank. A linear readout represents most of the output. The
                     network is trained on the remaining part, which is small and has kinks. Therefore the smallest
                     weight decay of this network is larger than in other kinds. The initial outputs of the plays are
                     estimated: if they are wrong, the network represents their errors, too.
fitted_operator_mlp  The further input is the output of a Prandtl-Ishlinskii model that is fitted to the data. A sum of
                     plays replaces the operators of Zhao & Tan 2008 and Shen & Ma 2017, and differs from them only in
                     the shape of the branches. The network represents the static nonlinearity.
rate_mlp             The further input of the network of Yu & Alici 2005 is du/dt, which does not represent the memory:
                     two descending branches can have the same u and du/dt. Therefore this network (``memory = "none"``)
                     can represent only signals with a single frequency. With ``memory = "plays"``, it has further
                     inputs. These are the outputs of a bank of plays, and the first and second derivatives of v, the
                     output of a fitted Prandtl-Ishlinskii model. The derivatives of v are needed because the linear
                     dynamics after the hysteresis have the output v - (2 zeta/omega_n) v' + ... This output depends on
                     the rate of v, and not on the rate of u. A derivative is the difference over the last step,
                     filtered by a first-order lag with the time constant tau.
zhao_tan_mlp         The network of Zhao & Tan 2008 (2-12-1) has the inputs x, the scaled u, and h, the output of the
                     hysteretic operator of x. The shape of the branch g(d) = (1 - e^-d) d depends on the scale of x.
                     Therefore the range to which the input is scaled is a parameter. By default, several ranges are
                     tried, and the range with the smallest training error is used. With an inverse operator, and data
                     whose input and output are exchanged, this kind gives the inverse model of the paper (section III).
"""

import numpy as np

from hystfmu.base import Array, InputError, Progress, silent
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node, Value
from hystfmu.identify.catalogue import CLOSES, LAGS, OPENS, Candidate, Memory, Option, Options, Row, scaled_input
from hystfmu.identify.features.plays import RANGE, branch_option, thresholds, u0_of, u0_option, with_plays
from hystfmu.identify.features.straightened import initial, straightened
from hystfmu.identify.network.readout import QUICK, Features, fit_readout, network_options
from hystfmu.identify.solvers.nonnegative import nonnegative

LEAST_DECAY = 1e-7  # of the kind play_bank_mlp
BEND = Option("bend", 5, 1, 20, text="degree of the polynomial of y that the operator is fitted to; 1: y itself")
SAMPLES = {"none": 0, "plays": 5}  # default of tau in samples; with a smaller tau, the second derivative is noise
FINER = 3  # number of plays in the Prandtl-Ishlinskii model of the kind rate_mlp, relative to the number in the bank
RANGES = (0.5, 1.0, 2.0)  # ranges of x that are tried; g is convex up to d = 2, as loops of this class require
QUICK_ROWS = 500  # number of rows in these trials
OPERATORS = {  # input and output of each block
    "zhao_tan": ("x", "h"),
    "zhao_tan_inverse": ("h", "x"),
    "zhao_tan_inverse_reconstructed": ("h", "x"),
}


def play_bank_mlp(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``(u, play_bank) -> scaling -> mlp -> scaling`` and a linear readout; return graph, number of parameters."""
    r = thresholds(data.u[data.train], options["N"])
    nodes = [Node("input", "scaling", {"n": 1}), _bank(r, initial(data, r) if options["u0"] is None else options["u0"])]
    front = Features(nodes, [("input.y", "bank.u")], ["input.u"], ["input.y", "bank.z"], data)
    graph, parameters, _ = fit_readout(front, data, options, seed, progress, linear=True, least_decay=LEAST_DECAY)
    return graph, parameters


def _bank(r: Array, z0: Value) -> Node:
    return Node("bank", "play_bank", {"n": len(r)}, {"r": r, "z0": z0})


def fitted_operator_mlp(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``(u, prandtl_ishlinskii) -> scaling -> mlp -> scaling``; return graph and number of parameters."""
    rows = data.counted
    v, free = straightened(data.u[rows], data.y[rows], options["bend"], data.covariates.values[rows])
    operator = _fitted(data, options["N"], options, v, free, "operator")
    progress(0.2)
    nodes = [Node("input", "scaling", {"n": 1}), operator]
    front = Features(nodes, [("input.y", "operator.u")], ["input.u"], ["input.y", "operator.y"], data)
    graph, parameters, _ = fit_readout(front, data, options, seed, lambda f: progress(0.2 + 0.8 * f))
    return graph, parameters + options["N"] + 1


def _fitted(data: Dataset, n: int, options: Options, target: Array, free: Array, name: str) -> Node:
    """Return a sum of n plays that, with a combination of the columns `free`, approximates `target` on fitted rows."""
    u0 = u0_of(data, options)
    r = thresholds(data.u[data.train], n)
    w, _ = nonnegative(with_plays(data.u, r, u0)[data.counted], target, free)
    return Node(name, "prandtl_ishlinskii", {}, {"w0": float(w[0]), "r": r, "w": w[1:], "u0": u0})


def rate_mlp(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``(u, rate[, bank, rates of v]) -> scaling -> mlp -> scaling``; return graph and number of weights."""
    memory = options["memory"]
    tau = SAMPLES[memory] * data.h if options["tau"] is None else options["tau"]
    nodes = [Node("input", "scaling", {"n": 1}), Node("rate", "differentiator", {}, {"tau": tau})]
    wires = [("input.y", "rate.u")]
    outputs = ["input.y", "rate.du"]
    if memory == "plays":
        y = data.y[data.counted]
        free = np.column_stack([np.ones(len(y)), data.covariates.values[data.counted]])
        nodes += [
            _bank(thresholds(data.u[data.train], options["N"]), u0_of(data, options)),
            _fitted(data, FINER * options["N"], options, y, free, "hysteresis"),
            Node("first", "differentiator", {}, {"tau": tau}),
            Node("second", "differentiator", {}, {"tau": tau}),
        ]
        wires += [("input.y", "bank.u"), ("input.y", "hysteresis.u")]
        wires += [("hysteresis.y", "first.u"), ("first.du", "second.u")]
        outputs += ["bank.z", "first.du", "second.du"]
    front = Features(nodes, wires, ["input.u"], outputs, data)
    graph, parameters, _ = fit_readout(front, data, options, seed, progress, linear=memory == "plays")
    return graph, parameters


def with_zhao_tan(data: Dataset, span: float, memory: str, u0: float, operator: str = "zhao_tan") -> Features:
    """Return the inputs of the network (features): the scaled input, and the output of the operator.

    `operator` is the block type of the operator. The scaled input has a range of width `span`. `memory` is the option
    of the operator, which rests at the input `u0`.
    """
    scaling, gain, offset = scaled_input(data.u[data.train], span)
    if operator == "zhao_tan":
        values: dict[str, Value] = {"memory": memory, "x0": gain * u0 + offset}
    elif memory == "dominant":
        scaling, values = scaling.with_values(offset=-gain * u0), {}  # an inverse operator rests at h = 0
    else:
        raise InputError(
            f"The 'memory' option with the operator {operator!r} must be 'dominant'. Got {memory!r} instead."
        )
    takes, gives = OPERATORS[operator]
    nodes = [scaling, Node("operator", operator, {}, values)]
    return Features(nodes, [("input.y", f"operator.{takes}")], ["input.u"], ["input.y", f"operator.{gives}"], data)


def zhao_tan_mlp(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``scaling -> zhao_tan -> scaling -> mlp -> scaling``; return graph and number of weights and biases."""
    u0 = u0_of(data, options)
    span = options["range"]
    if span is None:
        quick, none = {**options, "starts": 1, "iterations": 40}, silent
        trials = []
        for i, trial in enumerate(RANGES):
            part = with_zhao_tan(data, trial, options["memory"], u0, options["operator"])
            trials.append((fit_readout(part, data, quick, seed, none, most_rows=QUICK_ROWS)[2], trial))
            progress(0.1 * (i + 1))
        span = min(trials)[1]
    part = with_zhao_tan(data, span, options["memory"], u0, options["operator"])
    graph, parameters, _ = fit_readout(part, data, options, seed, lambda f: progress(0.3 + 0.7 * f))
    return graph, parameters


KINDS = {
    "play_bank_mlp": Row(
        "bank of plays and a network on them",
        play_bank_mlp,
        (
            Option("N", 32, 1, 10000, text="number of plays"),
            Option("u0", None, -1e300, 1e300, text="initial memory: every play rests at this input; default estimated"),
            *network_options(hidden=6, starts=2, iterations=150, least_decay=LEAST_DECAY),
        ),
        (Candidate(CLOSES, 2.0, 0.05, quick=QUICK),),
        Memory(700.0, "N"),
        records=True,
        covariates=True,
        own_memory=True,
    ),
    "fitted_operator_mlp": Row(
        "fitted weighted plays and a network on (x, their sum)",
        fitted_operator_mlp,
        (
            Option("N", 40, 1, 100000, text="number of plays"),
            BEND,
            u0_option("every play rests"),
            *network_options(hidden=12, starts=3, iterations=150),
        ),
        (Candidate(CLOSES, 1.0, 0.05, quick=QUICK),),
        Memory(1800.0, "N"),
        covariates=True,
    ),
    "rate_mlp": Row(
        "network on the input, its rate and a bank of plays",
        rate_mlp,
        (
            Option(
                "memory", "plays", choices=("plays", "none"), text="inputs besides (u, du/dt); none: as in the paper"
            ),
            Option("N", 12, 1, 10000, text="number of plays in the bank"),
            Option(
                "tau", None, 0.0, 1e12, text="time constant of a derivative (s); default 5 samples, 0 without memory"
            ),
            u0_option("every play rests"),
            *network_options(hidden=6, starts=2, iterations=150),
        ),
        (Candidate(LAGS, 2.0, 0.05, quick=QUICK),),
        Memory(1000.0, "N"),
        covariates=True,
    ),
    "zhao_tan_mlp": Row(
        "Zhao-Tan operator and a network on (x, h)",
        zhao_tan_mlp,
        (
            Option("operator", "zhao_tan", choices=tuple(OPERATORS), text="block of the second input of the network"),
            branch_option(),
            RANGE,
            u0_option("the operator rests"),
            *network_options(hidden=12, starts=3, iterations=150),
        ),
        (
            Candidate(CLOSES, 2.0, 0.05, quick=QUICK),
            Candidate(OPENS, 2.0, 0.05, {"memory": "last"}, QUICK),
        ),
        covariates=True,
    ),
}
