"""Kinds of model. Each module contains a table `KINDS` with its kinds, and `MODULES` states the module of each kind."""

MODULES = {
    "actuator": "actuator",
    "bouc_wen": "bouc_wen",
    "bouc_wen_oscillator": "bouc_wen_oscillator",
    "bouc_wen_parallel": "bouc_wen_parallel",
    "constraint_factor_mlp": "constraint_factor_mlp",
    "duhem": "duhem",
    "duhem_oscillator": "duhem_oscillator",
    "fitted_operator_mlp": "operator_networks",
    "g0_bouc_wen": "bouc_wen",
    "g0_jiles_atherton": "jiles_atherton",
    "g0_prandtl_ishlinskii": "weighted_sums",
    "krasnoselskii_pokrovskii": "weighted_sums",
    "narx_network": "narx_network",
    "play_bank_mlp": "operator_networks",
    "polynomial_narx": "polynomial_narx",
    "prandtl_ishlinskii": "weighted_sums",
    "preisach": "preisach",
    "rate_mlp": "operator_networks",
    "zhao_tan_mlp": "operator_networks",
}
