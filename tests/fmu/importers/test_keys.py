"""Every kind of model from data to the FMU of its inverse: fit, file, run, inverse or the reason why none exists.

The native run of the saved model, the Python unit, and the FMI 2.0 and 3.0 FMUs in fmpy give the same bits.  The
Modelica packages of models and of their inverses are written here, and simulated in tests/modelica/export.
"""

from pathlib import Path
from typing import Any

import numpy as np
import plants
import pytest
from cheap_choice import among_cheap
from click.testing import CliRunner
from fmpy.validation import validate_fmu
from fmu_events import Events, adaptive
from runners import run_by_fmpy, run_by_unit
from scipy.signal import lsim

from hystfmu import Dataset, Graph, InputError, Model, signals
from hystfmu.base.arrays import Array
from hystfmu.cli import main
from hystfmu.fmu import export_fmu
from hystfmu.identify import METHODS, fit
from hystfmu.inverse import METHODS as INVERSES
from hystfmu.inverse import inverse
from hystfmu.modelica import export_modelica

H = 1e-3
W_N = 2 * np.pi * 60  # natural frequency of the mode in records for kinds with dynamics, rad/s
SHORT: dict[str, Any] = {"starts": 1, "iterations": 25}
OPTIONS: dict[str, dict[str, Any]] = {
    "bouc_wen": {"starts": 2}, "bouc_wen_parallel": {"degree": 3, "rate": "no"},
    "prandtl_ishlinskii": {"N": 20, "w0_min": 0.1}, "zhao_tan_mlp": SHORT, "constraint_factor_mlp": SHORT,
    "fitted_operator_mlp": {**SHORT, "N": 20}, "play_bank_mlp": {**SHORT, "N": 8}, "rate_mlp": {**SHORT, "N": 6},
    "narx_network": {"lags": 2, "hidden": 3, "one_step": 20, "iterations": 10},
    "polynomial_narx": {"n_u": 3, "n_f": 3, "n_k": 0}, "preisach": {"n": 16, "widths": 8, "means": 3, "rate": "no"},
    "krasnoselskii_pokrovskii": {"levels": 12}, "actuator": {"N": 10, "dynamics": "no", "creep": "yes"},
    "g0_prandtl_ishlinskii": {"N": 10},
}  # fmt: skip
KEYS = [*METHODS, "duhem slopes=saturating", "preisach density=bell"]  # with the options that select other blocks
WAYS = tuple(way for way in INVERSES if way != "adaptive")  # that one reads a measured output, too
# words of the error for keys without an inverse of that kind
NO_CHAIN, PAST = ("no exact inverse", "learned"), ("past inputs only", "no causal inverse")
OSCILLATORS = ("bouc_wen_oscillator", "duhem_oscillator", "maxwell_slip_oscillator")
CHAINS = ("prandtl_ishlinskii", "g0_prandtl_ishlinskii", "actuator", "auto")
REFUSED: dict[tuple[str, str], tuple[str, ...]] = {
    **{("exact", key): NO_CHAIN for key in METHODS if key not in CHAINS},
    **{(way, key): PAST for way in WAYS for key in OSCILLATORS},
    ("implicit", "lugre"): ("at friction", "sample time"),
    ("implicit", "modified_bouc_wen"): ("at damper", "sample time"),
    ("implicit", "rate_mlp"): ("at rate", "sample time"),
    ("implicit", "polynomial_narx"): ("at network", "sample time"),
    ("implicit", "narx_network"): ("at network", "sample time"),
}
BOUND = {
    "exact": 1e-12,
    "implicit": 1e-10,
    "learned": 8.0,
}  # max error of inverse -> model, % of span; learned: little training
BOUND_OF = {
    # the number of sub-steps of its integration jumps with |du|, and with it the output, by 1e-12 to 1e-5 of the span,
    # as the fitted slopes are flat or steep: no root is finer
    ("implicit", "duhem"): 1e-2,
    # a network with fed-back outputs, whose memory is not that of plays
    ("learned", "narx_network"): 20.0,
    # saturating slopes: the output approaches a bound that the input sets, which is not a memory of plays
    ("learned", "duhem"): 12.0,
    # a force that depends on the speed, which the network does not read
    ("learned", "lugre"): 40.0,
    ("learned", "modified_bouc_wen"): 40.0,
}
LATE = 0.1  # the same with dynamics, after the lag
LEARNED: dict[str, Any] = {"starts": 1, "iterations": 30, "N": 8, "hidden": 6}
# a learned inverse has one structure and knows its model by predictions only: an operator, an ODE, a network
TAUGHT = ("prandtl_ishlinskii", "bouc_wen", "rate_mlp")


def plant(u: Array) -> Array:
    """Return a linear term plus six plays."""
    return 2 * u + plants.plays(u, np.array([0.07, 0.15, 0.22, 0.31, 0.42, 0.58])).sum(axis=1)


def every_option(key: str) -> dict[str, Any]:
    return OPTIONS.get(key, {})


def ramps(graph: Graph) -> bool:
    """Tell whether an input of continuous dynamics is linear between two steps in Co-Simulation."""
    return any(n.values.get("hold", n.block.hold) == "foh" for n in graph.nodes)


def data_for(key: str) -> Dataset:
    if key not in OSCILLATORS:
        u = signals.training(14, 3)[::2]
        y = plant(u)
        if key.startswith(
            "g0_"
        ):  # without a mode in the record, f_n ends at a bound of the search and zeta at any value
            y = lsim(([W_N**2], [1.0, 0.6 * W_N, W_N**2]), y, np.arange(len(y)) * H)[1]
        return Dataset.from_signal(u, y, H, "plays")
    spectrum = np.zeros(501, complex)
    spectrum[5:60] = np.exp(2j * np.pi * np.random.default_rng(2).uniform(size=55))
    u = np.fft.irfft(spectrum, 1000)
    u *= 60 / u.std()
    return Dataset.from_signal(u, plants.bouc_wen_oscillator(u, H), H, "oscillator")


def fitted_model(key: str, fitted: dict[str, Model]) -> Model:
    """Return a model of a key of KEYS, fitted once per session; ``auto`` chooses among cheap candidates."""
    if key not in fitted:
        kind, *words = key.split()
        options = every_option(kind) | dict(word.split("=") for word in words)
        with pytest.MonkeyPatch.context() as patch:
            among_cheap(patch, 0.7)
            fitted[key] = fit(data_for(kind), kind, seed=1, **options)
    return fitted[key]


@pytest.fixture
def model(request: pytest.FixtureRequest, fitted: dict[str, Model]) -> Model:
    return fitted_model(request.param, fitted)


every_key = pytest.mark.parametrize("model", KEYS, indirect=True)


def same_bits(model: Model, u: Array, folder: Path) -> Array:
    """Return the response to u after checking that all ways to run the model give the same bits."""
    model.save(folder / "m.model.toml")
    loaded = Model.load(folder / "m.model.toml")
    assert loaded.graph.to_bytes() == model.graph.to_bytes()
    assert loaded.step == model.step == H
    y = loaded.predict(u)
    assert y.tobytes() == model.predict(u).tobytes()
    assert np.isfinite(y).all()
    assert np.ptp(y) > 0
    assert run_by_unit(loaded.graph, u[:, None], H).tobytes() == y.tobytes()
    for fmi in (2, 3):
        fmu = export_fmu(loaded, folder / f"m{fmi}.fmu", fmi)  # type: ignore[arg-type]
        assert validate_fmu(str(fmu)) == []
        assert run_by_fmpy(fmu, folder / f"m{fmi}", u[:, None], H).tobytes() == y.tobytes()
    return y


def in_model_exchange(model: Model, u: Array, folder: Path, every: int = 5) -> None:
    """Run the FMU in Model Exchange: equal bits without continuous states, else within the solver tolerance.

    With continuous states `every` n-th row is a row of the signal: the solver takes a hundred evaluations for each.
    """
    if model.graph.continuous_states:
        u = u[::every]
    y = model.predict(u)
    for fmi in (2, 3):
        m = Events(model.graph, folder, fmi, interface="me")
        hold = "ramp" if ramps(model.graph) else "end"
        got = m.integrate(u[:, None], H, adaptive, hold)[:, 0]
        m.free()
        if model.graph.continuous_states:
            # exact for held inputs; order 2 where a hysteretic signal runs linearly; an implicit inverse of creep is
            # that of a step, and the shortest lag here lasts one
            of_step = any(n.block.trial for n in model.graph.nodes)
            limit = 2e-2 if of_step else 1e-2 if ramps(model.graph) else 1e-9
            assert np.abs(got - y).max() <= limit * np.ptp(y)
        else:
            assert got.tobytes() == y.tobytes()


def in_modelica(model: Model, folder: Path) -> None:
    """Write the Modelica package, or refuse in one line that names the block."""
    if any(n.block.trial for n in model.graph.nodes) and model.graph.continuous_states:
        with pytest.raises(InputError, match="no static form of 'creep' for an implicit inverse"):
            export_modelica(model, folder, "Kind")
        return
    package = export_modelica(model, folder, "Kind")
    assert {"Model.mo", "Values.mo", "Example.mo"} <= {f.name for f in package.iterdir()}


def signal_for(model: Model) -> Array:
    lo, hi = model.provenance["span_u"]
    return (lo + hi) / 2 + (hi - lo) / 2 * signals.nested_reversals(12, 5, step=0.02)


@pytest.mark.some(1)
@every_key
def test_a_key_gives_the_same_bits_everywhere(model: Model, tmp_path: Path) -> None:
    u = signal_for(model)
    same_bits(model, u, tmp_path)
    in_modelica(model, tmp_path)
    in_model_exchange(model, u[:150], tmp_path / "exchange")
    assert model.fit["rms_percent"] < 5


@pytest.mark.stress
@every_key
def test_a_key_agrees_in_model_exchange_over_many_rows(model: Model, tmp_path: Path) -> None:
    in_model_exchange(model, signal_for(model)[:150], tmp_path, every=1)


def ways() -> list[Any]:
    """Every key with every kind of inverse; the long runs train the inverses of the keys that are not TAUGHT."""
    long = {(key, "learned") for key in KEYS if key not in TAUGHT and ("learned", key) not in REFUSED}
    every = [(key, way) for way in WAYS for key in KEYS]
    return [pytest.param(*row, marks=pytest.mark.stress if row in long else ()) for row in every]


@pytest.mark.some(1)
@pytest.mark.parametrize(("model", "way"), ways(), indirect=["model"])
def test_a_key_has_an_inverse_or_a_reason(model: Model, way: str, tmp_path: Path) -> None:
    model.save(tmp_path / "forward.model.toml")
    settings = [w for k, v in LEARNED.items() for w in ("--set", f"{k}={v}")] if way == "learned" else []
    out = tmp_path / "inverse.model.toml"
    done = CliRunner().invoke(
        main, ["inverse", str(tmp_path / "forward.model.toml"), "-o", str(out), "--method", way, *settings]
    )
    words = REFUSED.get((way, model.key))
    if words:
        assert done.exit_code == 2
        assert done.output.count("\n") == 1
        for w in words:
            assert w in done.output
        return
    assert done.exit_code == 0, done.output
    made = Model.load(out)
    assert made.key == f"{model.key}_inverse"
    worth = made.fit["cascade_max_percent"]
    late = made.fit.get("lag_steps")
    bound = BOUND_OF.get((way, model.key), BOUND[way])
    assert made.fit["cascade_rms_percent"] <= worth <= max(bound, LATE if late else 0.0)
    r = model.predict(0.8 * signals.nested_reversals(12, 5, step=0.02))
    u = same_bits(made, r, tmp_path)
    in_modelica(made, tmp_path)
    in_model_exchange(made, r[:150], tmp_path / "exchange")
    if late is not None:  # dynamics do not follow the kinks of this signal; see test_inverse_dynamics
        return
    assert np.abs(model.predict(u) - r).max() <= max(2 * worth, BOUND["exact"]) / 100 * np.ptp(r)  # another signal


def test_a_dead_band_is_part_of_the_model(tmp_path: Path) -> None:
    data = data_for("")
    u = data.u + 0.01 * np.random.default_rng(0).normal(size=len(data.u))
    model = fit(Dataset.from_signal(u, data.y, H), "duhem")
    assert model.graph.node("dead_band").value("r")[0] == model.provenance["options"]["dead_band"] > 0.01
    same_bits(model, u[:400], tmp_path)


def test_every_key_has_an_inverse_or_a_proof() -> None:
    """Exact or by one root a step; models of rates and of lagged inputs are learned; an oscillator has none."""
    ways_of = {key: [way for way in WAYS if (way, key) not in REFUSED] for key in METHODS}
    learned = [key for key, found in ways_of.items() if found == ["learned"]]
    assert learned == ["lugre", "modified_bouc_wen", "narx_network", "polynomial_narx", "rate_mlp"]
    assert [key for key, found in ways_of.items() if not found] == [*OSCILLATORS]


def test_missing_inverses_are_refused() -> None:
    data = data_for("")
    lagged = fit(data, "polynomial_narx", n_u=2, n_f=2, n_k=1)
    for way in WAYS:
        with pytest.raises(InputError, match="past inputs only"):
            inverse(lagged, way)
    plays_only = fit(data.with_output(data.y - 2 * data.u), "prandtl_ishlinskii", N=20)
    with pytest.raises(
        InputError, match=r"'w0' .* Got 0 instead: a sum of plays without linear term .* no continuous inverse"
    ):
        inverse(plays_only)
