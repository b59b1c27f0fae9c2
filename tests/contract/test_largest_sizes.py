"""Upper limits of the sizes of every block: a model of today must open in every later release.

Nothing else states them: the README, the signatures and the Modelica classes have defaults and lower limits.
"""

from __future__ import annotations

from hystfmu.core.library import block_types

LARGEST = {
    "adaptive_inverse": {"n": 500, "delay": 1000},
    "backlash_sum": {"n": 100000},
    "constraint_factor": {"m": 20, "depth": 100000},
    "constraint_factor_inverse": {"m": 20, "depth": 100000},
    "creep": {"n": 100000},
    "creep_inverse": {"n": 100000},
    "dead_zones": {"n": 100000},
    "delay": {"n": 1000000},
    "disturbance_observer": {"n": 100000},
    "duhem": {"m": 20, "q": 20},
    "duhem_oscillator": {"n": 1000},
    "in_range": {"n": 100000},
    "iterative_learning": {"n": 1000000},
    "krasnoselskii_pokrovskii": {"n": 1000, "depth": 100000},
    "lead_lag": {"n": 1000},
    "mlp": {"n_in": 10000, "n_hidden": 10000, "n_out": 10000},
    "modes": {"n": 1000},
    "narx_network": {"n_u": 1000, "n_y": 1000, "n_hidden": 10000},
    "play_bank": {"n": 100000},
    "polynomial_narx": {"n_u": 1000, "n_f": 1000, "n_y": 1000, "q": 10, "n_k": 1},
    "prandtl_ishlinskii": {"n": 100000, "depth": 100000},
    "prandtl_ishlinskii_inverse": {"n": 100000, "depth": 100000},
    "preisach": {"n": 1000, "depth": 100000},
    "product": {"n": 1000, "m": 1000},
    "recursive_least_squares": {"n": 1000},
    "reference": {"m": 100000},
    "repetitive": {"n": 1000000, "n_q": 10000, "n_l": 10000},
    "scaling": {"n": 100000},
    "sum": {"n": 100000},
    "transfer_function": {"na": 32, "nb": 32},
    "zhao_tan": {"depth": 100000},
    "zhao_tan_inverse": {"depth": 100000},
    "zhao_tan_inverse_reconstructed": {"depth": 100000},
}


def test_sizes_may_be_as_large_as_ever() -> None:
    assert {name: {d.name: d.hi for d in b.dims} for name, b in block_types().items() if b.dims} == LARGEST
