"""What the options of every kind promise: a model file names only what was given, so a default must not move unseen."""

from importlib import import_module
from pkgutil import iter_modules

import numpy as np
import pytest

from hystfmu import InputError
from hystfmu.identify import catalogue, methods
from hystfmu.identify.catalogue import ANY, CLOSES, LAGS, LATE, OPENS, Candidate, Option
from hystfmu.identify.features.plays import u0_option
from hystfmu.identify.network.readout import network_options

U0 = {"u0": (None, -1e300, 1e300)}
DYNAMICS = {"delay_max": (10.0, 0.0, 1e5), "zeta_max": (5.0, 0.01, 1e3)}
STRIDE = {"stride": (1, 1, 1_000_000)}
BAND = {"dead_band": (None, 0.0, 1e300)}


def network(hidden: int, starts: int, iterations: int):
    return {
        "hidden": (hidden, 1, 10_000),
        "starts": (starts, 1, 1000),
        "iterations": (iterations, 1, 100_000),
        "decay": (None, 0.0, 1e3),
        "margin": (0.05, 0.0, 1e300),
    }


NUMBERS = {  # default, least and largest value
    "actuator": {"N": (40, 1, 10_000), "bend": (None, 1, 20), "w0_min": (1e-3, 0.0, 1.0), **U0, **DYNAMICS},
    "bouc_wen": {"starts": (6, 1, 1000), "n_max": (6.0, 1.0, 20.0), "z0": (None, -1.0, 1.0), **BAND},
    "bouc_wen_parallel": {"n_max": (6.0, 1.0, 20.0), "degree": (None, 1, 20)},
    "bouc_wen_oscillator": {"nu": (1.0, 1.0, 20.0), **STRIDE},
    "constraint_factor_mlp": {
        "m": (9, 1, 20), "roughness": (1e-4, 0.0, 1e3), "bend": (5, 1, 20), "range": (1.0, 1e-6, 10.0),
        "sweep": (0, 0, 1000), **U0, **network(5, 3, 230),
    },
    "duhem": {"m": (None, 0, 100), "q": (5, 1, 10), **BAND},
    "duhem_oscillator": STRIDE,
    "fitted_operator_mlp": {"N": (40, 1, 100_000), "bend": (5, 1, 20), **U0, **network(12, 3, 150)},
    "g0_bouc_wen": {"n_max": (6.0, 1.0, 20.0), **DYNAMICS},
    "g0_jiles_atherton": DYNAMICS,
    "g0_prandtl_ishlinskii": {"N": (40, 1, 10_000), "w0_min": (0.0, 0.0, 1e300), **U0, **DYNAMICS},
    "krasnoselskii_pokrovskii": {"levels": (20, 1, 200), **U0},
    "lugre": {"starts": (6, 1, 6)},
    "maxwell_slip_oscillator": {},
    "modified_bouc_wen": {},
    "narx_network": {
        "lags": (10, 1, 1000), "hidden": (15, 1, 10_000), "one_step": (40, 1, 100_000), "iterations": (40, 1, 100_000),
        "y0": (None, -1e300, 1e300),
    },
    "play_bank_mlp": {"N": (32, 1, 10_000), **U0, **network(6, 2, 150)},
    "polynomial_narx": {
        "n_u": (9, 1, 1000), "n_f": (9, 0, 1000), "n_y": (0, 0, 1000), "n_k": (1, 0, 1), "q": (2, 1, 10),
        "ridge": (1e-3, 1e-12, 1e6), "range": (None, 1e-6, 1e6),
        "margin": (0.05, 0.0, 1e300), **U0,
    },
    "prandtl_ishlinskii": {"N": (40, 1, 100_000), "w0_min": (0.0, 0.0, 1e300), **U0},
    "preisach": {"bend": (5, 1, 20), "n": (40, 1, 100), "widths": (32, 2, 100), "means": (8, 1, 50)},
    "rate_mlp": {"N": (12, 1, 10_000), "tau": (None, 0.0, 1e12), **U0, **network(6, 2, 150)},
    "zhao_tan_mlp": {"range": (None, 1e-6, 1e6), **U0, **network(12, 3, 150)},
    "auto": {},
}  # fmt: skip
WORDS = {  # the default comes first; None: chosen from the data
    "actuator": {
        "operator": (None, "plays", "stops", "relays"),
        "creep": (None, "yes", "no"), "dynamics": (None, "yes", "no"), "covariates": (None, "offset", "gain", "bend"),
        "hold": ("foh", "foh", "zoh"),
    },
    "duhem": {"slopes": ("polynomial", "polynomial", "saturating")},
    "bouc_wen_parallel": {"rate": (None, "yes", "no"), "series": (None, "yes", "no")},
    "g0_bouc_wen": {"hold": ("foh", "foh", "zoh")},
    "g0_jiles_atherton": {"strain": (None, "no", "yes"), "hold": ("foh", "foh", "zoh")},
    "constraint_factor_mlp": {"branch": ("increasing", "increasing", "literal")},
    "preisach": {
        "density": ("linear", "linear", "bell"),
        "rate": (None, "yes", "no"),
        "start": ("demagnetised", "demagnetised", "low", "high"),
    },
    "rate_mlp": {"memory": ("plays", "plays", "none")},
    "zhao_tan_mlp": {"memory": ("dominant", "dominant", "last")},
    "play_bank_mlp": {
        "activation": ("sigmoid", "sigmoid", "tanh"),
        "trainer": ("levenberg_marquardt", "levenberg_marquardt", "powell_beale", "lbfgs"),
    },
}  # fmt: skip


@pytest.mark.parametrize("key", NUMBERS)
def test_the_numbers_of_a_kind_have_their_default_and_range(key):
    table = {o.name: o for o in catalogue.options(key)}
    assert [name for name, o in table.items() if not o.choices] == [n for n in table if n in NUMBERS[key]]
    assert NUMBERS[key].keys() <= table.keys()
    for name, (default, least, most) in NUMBERS[key].items():
        option = table[name]
        assert option.default == default, name
        assert type(option.default) is type(default), name
        for end in (least, most):
            assert option.check(end) == end, name
        whole = isinstance(default, int)
        for outside in (least - 1, most + 1) if whole else (np.nextafter(least, -np.inf), np.nextafter(most, np.inf)):
            with pytest.raises(InputError, match=rf"'{name}' must be an? (int|float) in \["):
                option.check(outside)


@pytest.mark.parametrize("key", WORDS)
def test_the_words_of_a_kind(key):
    table = {o.name: o for o in catalogue.options(key)}
    for name, (default, *choices) in WORDS[key].items():
        assert table[name].default == default
        assert table[name].choices == tuple(choices)


QUICK_NETWORK = {"starts": 1, "iterations": 30}
SMALL_NARX = {"lags": 4, "hidden": 6, "one_step": 30, "iterations": 15}
COMPETE = {  # memory, seconds fixed and per 1000 rows, options, quick, local
    "actuator": (ANY, 0.6, 0.08, {}, {}, False),
    "bouc_wen": (OPENS, 0.2, 0.4, {}, {"starts": 1}, False),
    "bouc_wen_parallel": (OPENS, 0.3, 0.6, {}, {}, False),
    "bouc_wen_oscillator": (LAGS, 0.3, 0.3, {}, {}, False),
    "constraint_factor_mlp": (CLOSES, 0.3, 0.1, {}, QUICK_NETWORK, False),
    "duhem": (OPENS, 0.2, 0.5, {}, {}, False),
    "duhem slopes=saturating": (OPENS, 0.5, 0.4, {"slopes": "saturating"}, {}, False),
    "duhem_oscillator": (LAGS, 0.5, 3.0, {}, {}, False),
    "fitted_operator_mlp": (CLOSES, 1.0, 0.05, {}, QUICK_NETWORK, False),
    "g0_bouc_wen": (LATE, 0.5, 0.4, {}, {}, False),
    "g0_jiles_atherton strain=no": (LATE, 0.5, 1.0, {"strain": "no"}, {}, False),
    "g0_jiles_atherton strain=yes": (LATE, 0.5, 1.2, {"strain": "yes"}, {}, False),
    "g0_prandtl_ishlinskii": (LAGS, 0.6, 0.1, {}, {}, False),
    "krasnoselskii_pokrovskii": (CLOSES, 0.02, 0.03, {}, {}, True),
    "lugre": (LATE, 0.3, 0.4, {}, {"starts": 1}, False),
    "maxwell_slip_oscillator": (ANY, 0.3, 0.4, {}, {}, False),
    "modified_bouc_wen": (LATE, 0.5, 1.3, {}, {}, False),
    "narx_network " + " ".join(f"{k}={v}" for k, v in SMALL_NARX.items()): (
        LAGS,
        1.0,
        1.5,
        SMALL_NARX,
        {**SMALL_NARX, "one_step": 15, "iterations": 4},
        False,
    ),
    "play_bank_mlp": (CLOSES, 2.0, 0.05, {}, QUICK_NETWORK, False),
    "polynomial_narx": (ANY, 0.05, 0.02, {}, {}, False),
    "prandtl_ishlinskii": (CLOSES, 0.02, 0.01, {}, {}, False),
    "prandtl_ishlinskii N=200": (CLOSES, 0.05, 0.06, {"N": 200}, {}, False),
    "preisach": (ANY, 1.2, 0.12, {}, {"n": 20, "widths": 12, "means": 4}, False),
    "preisach density=bell": (ANY, 0.5, 0.8, {"density": "bell"}, {"n": 20}, False),
    "rate_mlp": (LAGS, 2.0, 0.05, {}, QUICK_NETWORK, False),
    "zhao_tan_mlp": (CLOSES, 2.0, 0.05, {}, QUICK_NETWORK, False),
    "zhao_tan_mlp memory=last": (OPENS, 2.0, 0.05, {"memory": "last"}, QUICK_NETWORK, False),
}


@pytest.mark.parametrize(
    ("default", "words"),
    [
        (None, "from the data"),
        (0.05, "0.05"),
        (1e-4, "0.0001"),
        (True, "true"),
        (False, "false"),
        (40, "40"),
        ("foh", "foh"),
    ],
)
def test_a_default_in_words(default, words):
    assert Option("x", default).shown_default == words


def test_options_that_kinds_share_are_made_with_their_defaults():
    made = {o.name: o for o in network_options(7, 4, 90, 1e-8)}
    assert list(made) == ["hidden", "activation", "starts", "trainer", "iterations", "decay", "margin"]
    assert {name: (made[name].default, made[name].lo, made[name].hi) for name in network(7, 4, 90)} == network(7, 4, 90)
    assert "at least 1e-08" in made["decay"].text
    assert made["activation"].choices == ("sigmoid", "tanh")
    made = u0_option("it rests")
    assert (made.name, made.default, made.lo, made.hi) == ("u0", None, -1e300, 1e300)
    assert made.text == "initial memory: it rests at this input; default the first input"


def test_who_competes_and_at_what_cost():
    found = catalogue.candidates()
    assert {name: c for name, (_, c) in found.items()} == {name: Candidate(*row) for name, row in COMPETE.items()}
    assert all(name.split()[0] == key for name, (key, _) in found.items())


RECORDS = {
    "krasnoselskii_pokrovskii", "lugre", "maxwell_slip_oscillator", "modified_bouc_wen", "play_bank_mlp",
    "prandtl_ishlinskii", "preisach",
}  # fmt: skip
COVARIATES = {
    "actuator", "constraint_factor_mlp", "fitted_operator_mlp", "play_bank_mlp", "polynomial_narx", "rate_mlp",
    "zhao_tan_mlp",
}  # fmt: skip


def test_who_takes_several_records_and_covariates():
    rows = {
        k: row
        for m in iter_modules(methods.__path__)
        for k, row in import_module(f"{methods.__name__}.{m.name}").KINDS.items()
    }
    assert (*sorted(rows), "auto") == catalogue.METHODS
    assert {k for k in rows if catalogue.method(k).records} == RECORDS
    assert {k for k in rows if catalogue.method(k).covariates} == COVARIATES
