"""Keys of the kinds of model, as a type."""

from typing import Literal

Kind = Literal[
    "actuator",
    "bouc_wen",
    "bouc_wen_oscillator",
    "bouc_wen_parallel",
    "constraint_factor_mlp",
    "duhem",
    "duhem_oscillator",
    "fitted_operator_mlp",
    "g0_bouc_wen",
    "g0_jiles_atherton",
    "g0_prandtl_ishlinskii",
    "krasnoselskii_pokrovskii",
    "lugre",
    "maxwell_slip_oscillator",
    "modified_bouc_wen",
    "narx_network",
    "play_bank_mlp",
    "polynomial_narx",
    "prandtl_ishlinskii",
    "preisach",
    "rate_mlp",
    "zhao_tan_mlp",
    "auto",
]
