"""Sizes of every block: smallest, default, largest.  A model of today must open in every later release as it is.

No other file states all sizes.  A file without a size means the default, and the reader has its own limits.  A block
that no release has yet may be missing here: CONTRIBUTING.md adds a block by four files.
"""

from hystfmu.core.library import block_types

SIZES = {
    "adaptive_inverse": {"n": (1, 10, 500), "delay": (0, 1, 1000)},
    "backlash_sum": {"n": (1, 10, 100000)},
    "constraint_factor": {"m": (1, 1, 20), "depth": (4, 256, 100000)},
    "constraint_factor_inverse": {"m": (1, 1, 20), "depth": (4, 256, 100000)},
    "creep": {"n": (1, 1, 100000)},
    "creep_inverse": {"n": (1, 1, 100000)},
    "dead_zones": {"n": (1, 6, 100000)},
    "delay": {"n": (1, 1, 1000000)},
    "disturbance_observer": {"n": (1, 1, 100000)},
    "duhem": {"m": (0, 0, 20), "q": (1, 1, 20)},
    "duhem_oscillator": {"n": (2, 5, 1000)},
    "in_range": {"n": (1, 1, 100000)},
    "iterative_learning": {"n": (1, 20, 1000000)},
    "jiles_atherton": {"steps": (1, 4, 1000)},
    "krasnoselskii_pokrovskii": {"n": (1, 4, 1000), "depth": (4, 256, 100000)},
    "lead_lag": {"n": (1, 1, 1000)},
    "mlp": {"n_in": (1, 1, 10000), "n_hidden": (1, 12, 10000), "n_out": (1, 1, 10000)},
    "modes": {"n": (1, 1, 1000)},
    "narx_network": {"n_u": (1, 2, 1000), "n_y": (0, 1, 1000), "n_hidden": (1, 4, 10000)},
    "play_bank": {"n": (1, 10, 100000)},
    "polynomial_narx": {
        "n_u": (1, 1, 1000),
        "n_f": (0, 1, 1000),
        "n_y": (0, 1, 1000),
        "q": (1, 2, 10),
        "n_k": (0, 1, 1),
    },
    "prandtl_ishlinskii": {"n": (1, 10, 100000), "depth": (4, 256, 100000)},
    "prandtl_ishlinskii_inverse": {"n": (1, 10, 100000), "depth": (4, 256, 100000)},
    "preisach": {"n": (1, 2, 1000), "depth": (4, 256, 100000)},
    "product": {"n": (1, 2, 1000), "m": (0, 1, 1000)},
    "recursive_least_squares": {"n": (1, 2, 1000)},
    "reference": {"m": (1, 10, 100000)},
    "repetitive": {"n": (2, 20, 1000000), "n_q": (0, 1, 10000), "n_l": (0, 1, 10000)},
    "scaling": {"n": (1, 1, 100000)},
    "sum": {"n": (1, 2, 100000)},
    "transfer_function": {"na": (1, 1, 32), "nb": (0, 0, 32)},
    "zhao_tan": {"depth": (4, 256, 100000)},
    "zhao_tan_inverse": {"depth": (4, 256, 100000)},
    "zhao_tan_inverse_reconstructed": {"depth": (4, 256, 100000)},
}


def test_sizes_are_as_they_have_been() -> None:
    found = {name: {d.name: (d.lo, d.start, d.hi) for d in b.dims} for name, b in block_types().items()}
    assert {name: found.get(name) for name in SIZES} == SIZES
