"""Network whose inputs are u and the outputs of a bank of plays, which represent the whole return-point memory.

Other kinds use two network inputs: the scaled input x, and the output h of an operator. These two values do not
determine the output, because the one-to-one theorem of Zhao & Tan 2008 has counterexamples. The outputs of a bank of
plays determine the output up to the resolution of the bank. A linear readout represents most of the output. The network
is trained on the remaining part, which is small and has kinks. Therefore the smallest weight decay of this network is
larger than in other kinds.
"""

from __future__ import annotations

from hystfmu.base.arrays import Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.identify.catalogue import CLOSES, Candidate, Memory, Option, Options
from hystfmu.identify.features.plays import thresholds, u0_of, u0_option
from hystfmu.identify.network.readout import Features, fit_readout, network_options

TEXT = "bank of plays and a network on them"
MEMORY = Memory(700.0, "N")
RECORDS = True
COVARIATES = True
LEAST_DECAY = 1e-7
CANDIDATES = (Candidate(CLOSES, 2.0, 0.05, quick={"starts": 1, "iterations": 30}),)
OPTIONS = (
    Option("N", 32, 1, 10000, text="number of plays"),
    u0_option("every play rests"),
    *network_options(hidden=6, starts=2, iterations=150, least_decay=LEAST_DECAY),
)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``(u, play_bank) -> scaling -> mlp -> scaling`` and a linear readout; return graph, number of parameters."""
    u0 = u0_of(data, options)
    r = thresholds(data.u[data.train], options["N"])
    nodes = [
        Node("input", "scaling", {"n": 1}),
        Node("bank", "play_bank", {"n": len(r)}, {"r": r, "z0": u0}),
    ]
    front = Features(nodes, [("input.y", "bank.u")], ["input.u"], ["input.y", "bank.z"], data)
    graph, parameters, _ = fit_readout(front, data, options, seed, progress, linear=True, least_decay=LEAST_DECAY)
    return graph, parameters
