"""The kinds of model by key: a line for people, the options of each, its module on first use."""

from __future__ import annotations

import importlib
from types import ModuleType

from hystfmu.base.errors import InputError
from hystfmu.base.extras import extras
from hystfmu.identify.options import Option

AUTO = "auto"

METHODS: dict[str, str] = {
    "prandtl_ishlinskii": "weighted plays, non-negative least squares; exact inverse",
    "prandtl_ishlinskii_asym": "plays, dead zones and creep of the input, least squares",
    "prandtl_ishlinskii_rate": "the same, bent by the lagged input too; ridge found",
    "zhao_tan_mlp": "Zhao-Tan operator and a network on (x, h)",
    "constraint_factor_mlp": "constraint-factor operator and a network on (x, h)",
    "fitted_operator_mlp": "fitted weighted plays and a network on (x, their sum)",
    "play_bank_mlp": "bank of plays and a network on them",
    "krasnoselskii_pokrovskii": "Krasnosel'skii-Pokrovskii kernels, weights >= 0",
    "preisach": "density of relays on a grid, weights >= 0: the Everett function",
    "polynomial_narx": "polynomial of the lagged input and Zhao-Tan operator, least squares",
    "bouc_wen": "Bouc-Wen grey box, nonlinear least squares",
    "duhem": "polynomial slopes for rising and falling input, least squares, refined on the free run",
    "rate_mlp": "network on the input, its rate and a bank of plays",
    "g0_prandtl_ishlinskii": "weighted plays, then G0(s) with delay, variable projection",
    "g0_bouc_wen": "Bouc-Wen hysteresis, then G0(s) with delay, variable projection",
    "bouc_wen_oscillator": "oscillator with a Bouc-Wen force, grey box, least squares",
    AUTO: "of those that suit the memory in the data, the best on the last 30 % of the training rows",
}


def method(key: str) -> ModuleType:
    """The module of a kind of model.

    Raises
    ------
    InputError
        Unknown key.
    """
    if key not in METHODS:
        raise InputError(f"no model {key!r}; there are: {', '.join(METHODS)}")
    with extras(f"the model {key}"):
        return importlib.import_module(f"hystfmu.identify.methods.{key}")


def options(key: str) -> tuple[Option, ...]:
    """The options of the method `key`.

    Raises
    ------
    InputError
        Unknown method.
    """
    if key == AUTO:
        return ()
    table: tuple[Option, ...] = method(key).OPTIONS
    return table
