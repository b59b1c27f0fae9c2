"""Kinds of model. Each module contains a table `KINDS` of its kinds."""

MODULES = {  # kinds whose module has another name
    "fitted_operator_mlp": "operator_networks",
    "g0_bouc_wen": "bouc_wen",
    "g0_jiles_atherton": "jiles_atherton",
    "g0_prandtl_ishlinskii": "weighted_sums",
    "krasnoselskii_pokrovskii": "weighted_sums",
    "play_bank_mlp": "operator_networks",
    "prandtl_ishlinskii": "weighted_sums",
    "rate_mlp": "operator_networks",
    "zhao_tan_mlp": "operator_networks",
}
