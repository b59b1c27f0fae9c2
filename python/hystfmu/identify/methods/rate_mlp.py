"""Network of Yu & Alici 2005 with the inputs u and du/dt, by default with further inputs that represent the memory.

The rate du/dt does not represent the memory: two descending branches can have the same u and du/dt. Therefore the
network of the paper (``memory = "none"``) can represent only signals with a single frequency. With ``memory =
"plays"``, the network has further inputs. These are the outputs of a bank of plays, and the first and second
derivatives of v, the output of a fitted Prandtl-Ishlinskii model. The derivatives of v are needed because the linear
dynamics after the hysteresis have the output v - (2 zeta/omega_n) v' + ... This output depends on the rate of v, and
not on the rate of u.

A derivative is the difference over the last step, filtered by a first-order lag with the time constant tau.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.identify.catalogue import LAGS, Candidate, Memory, Option, Options
from hystfmu.identify.features.plays import plays, thresholds, u0_of, u0_option
from hystfmu.identify.network.readout import Features, fit_readout, network_options
from hystfmu.identify.solvers.nonnegative import nonnegative

TEXT = "network on the input, its rate and a bank of plays"
MEMORY = Memory(1000.0, "N")
COVARIATES = True
SAMPLES = {"none": 0, "plays": 5}  # default of tau in samples; with a smaller tau, the second derivative is noise
FINER = 3  # number of plays in the Prandtl-Ishlinskii model, relative to the number in the bank

CANDIDATES = (Candidate(LAGS, 2.0, 0.05, quick={"starts": 1, "iterations": 30}),)
OPTIONS = (
    Option("memory", "plays", choices=("plays", "none"), text="inputs besides (u, du/dt); none: as in the paper"),
    Option("N", 12, 1, 10000, text="number of plays in the bank"),
    Option("tau", None, 0.0, 1e12, text="time constant of a derivative (s); default 5 samples, 0 without memory"),
    u0_option("every play rests"),
    *network_options(hidden=6, starts=2, iterations=150),
)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``(u, rate[, bank, rates of v]) -> scaling -> mlp -> scaling``; return graph and number of weights."""
    memory = options["memory"]
    tau = SAMPLES[memory] * data.h if options["tau"] is None else options["tau"]
    nodes = [Node("input", "scaling", {"n": 1}), Node("rate", "differentiator", {}, {"tau": tau})]
    wires = [("input.y", "rate.u")]
    outputs = ["input.y", "rate.du"]
    if memory == "plays":
        u0 = u0_of(data, options)
        r = thresholds(data.u[data.train], options["N"])
        nodes += [
            Node("bank", "play_bank", {"n": len(r)}, {"r": r, "z0": u0}),
            Node("hysteresis", "prandtl_ishlinskii", {}, _weights(data, FINER * options["N"], u0)),
            Node("first", "differentiator", {}, {"tau": tau}),
            Node("second", "differentiator", {}, {"tau": tau}),
        ]
        wires += [("input.y", "bank.u"), ("input.y", "hysteresis.u")]
        wires += [("hysteresis.y", "first.u"), ("first.du", "second.u")]
        outputs += ["bank.z", "first.du", "second.du"]
    front = Features(nodes, wires, ["input.u"], outputs, data)
    graph, parameters, _ = fit_readout(front, data, options, seed, progress, linear=memory == "plays")
    return graph, parameters


def _weights(data: Dataset, n: int, u0: float) -> dict[str, float | Array]:
    r = thresholds(data.u[data.train], n)
    columns = np.column_stack([data.u, plays(data.u, r, u0)])[data.counted]
    free = np.column_stack([np.ones(len(columns)), data.covariates.values[data.counted]])
    w, _ = nonnegative(columns, data.y[data.counted], free)
    return {"w0": float(w[0]), "r": r, "w": w[1:], "u0": u0}
