"""Inverses: exact ones are identities in cascade, learned ones approximate, refusals state the reason."""

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import plants
import pytest
from series import series

from hystfmu import Dataset, Graph, Input, InputError, Model, Node, Output, signals
from hystfmu.identify import fit
from hystfmu.inverse import Inverses, inverse, learned
from hystfmu.inverse.ports import over_range
from papers import nested_loops, zhao_tan_2008


def fitted(key="prandtl_ishlinskii", noise=0.0, u=None, **options):
    u = signals.training(60, 1) if u is None else u
    y = plants.prandtl_ishlinskii(u)
    y = y + noise * np.ptp(y) * np.random.default_rng(0).normal(size=len(y))
    data = Dataset(np.arange(len(u)) * 1e-3, u, y + 4, unit_u="V", unit_y="um")
    return fit(data, key, **options)


def wanted(model, share=0.9):
    """Return wanted outputs: held-out signals scaled into the range that the model reaches."""
    y = model.predict(np.concatenate([signals.training(5, 1)]))
    middle, half = (y.max() + y.min()) / 2, share * np.ptp(y) / 2
    start = model.predict(np.zeros(2))[0]
    for name, r in signals.held_out().items():
        yield name, start + (middle - start) * np.minimum(np.arange(len(r)) / 50, 1) + half * r


def test_exact_inverse_in_cascade_with_its_model():
    m = fitted()
    inv = inverse(m)
    span = m.predict(signals.training(5, 1)).max()
    for name, r in wanted(m):
        assert np.abs(m.predict(inv.predict(r)) - r).max() <= 1e-14 * span, name
    assert (inv.key, inv.step) == ("prandtl_ishlinskii_inverse", m.step)
    assert (inv.graph.inputs[0].unit, inv.graph.outputs[0].unit) == ("um", "V")
    assert (inv.graph.inputs[0].name, inv.graph.outputs[0].name) == ("u", "y")
    texts = [
        "wanted output: output of the record data, in um",
        "input for the wanted output: input of the record data, in V",
    ]
    assert [inv.graph.inputs[0].text, inv.graph.outputs[0].text] == texts
    assert inverse(chain()).graph.inputs[0].text == "wanted output"


def test_an_implicit_inverse_undoes_creep_too():
    creep = Node("creep", "creep", {}, {"w0": 1.0, "w": [0.05, 0.1], "T": [0.01, 0.1], "start": "steady"})
    model = Model("creeping", series(fitted().graph.nodes[0], creep), 1e-3)
    made = inverse(model, "implicit", lo=-1.5, hi=1.5)
    for name, r in wanted(model):
        assert np.abs(model.predict(made.predict(r)) - r).max() <= 1e-12 * np.ptp(r), name


def test_the_inverse_of_the_inverse_is_the_model():
    m = fitted()
    back = inverse(inverse(m))
    u = signals.nested_reversals(50, 9)
    np.testing.assert_allclose(back.predict(u), m.predict(u), rtol=0, atol=1e-13)
    assert (back.key, back.graph.inputs[0].text) == (m.key, "wanted output: input of the record data, in V")


def test_an_exact_inverse_survives_its_file(tmp_path):
    inverse(fitted()).save(tmp_path / "i.model.toml")
    assert Model.load(tmp_path / "i.model.toml").graph.to_bytes() == inverse(fitted()).graph.to_bytes()


def chain(*nodes, memory="dominant"):
    """scaling -> zhao_tan -> scaling with limits."""
    graph = series(
        Node("a", "scaling", {"n": 1}, {"gain": -1.5, "offset": 0.2, "lo": -0.9}),
        Node("b", "zhao_tan", {}, {"memory": memory, "x0": 0.2}),
        Node("c", "scaling", {"n": 1}, {"gain": 3.0, "offset": -1.0}),
    )
    return Model("chain", graph)


def test_zhao_tan_between_scalings():
    m = chain()
    u = 0.8 * signals.nested_reversals(40, 3)
    np.testing.assert_allclose(inverse(m).predict(m.predict(u)), u, atol=1e-13)
    far = m.predict(np.linspace(0, -3, 50))  # beyond its limit both model and inverse are constant
    assert inverse(m).predict(np.r_[far, far[-1] + 5]).min() >= -0.9 - 1e-12


@pytest.mark.parametrize("values", [
    {"a0": 0.5, "a": [1.0, 0.25], "d_max": 3.0},  # a straight line beyond 3
    {"a0": 1e-3, "a": [1.0]},  # nearly flat where a branch starts
    {"a0": 0.01, "a": [0.0] * 8 + [1.0], "d_max": 4.0, "x0": 0.3},  # d^18
    {"a0": 2.0, "a": [0.0], "d_max": 9.0},  # flat at the far end
])  # fmt: skip
def test_constraint_factor(values):
    """In the output to the last bits of the span; in the input as far as its slope allows."""
    m = Model("c", Graph.single(Node("c", "constraint_factor", {}, values)))
    back = inverse(m)
    for u in signals.held_out().values():
        h = m.predict(u)
        x = back.predict(h)
        assert np.abs(m.predict(x) - h).max() <= 1e-15 * np.ptp(h)
        if values["a0"] >= 0.5:
            assert np.abs(x - u).max() <= 1e-13
    np.testing.assert_array_equal(inverse(back).predict(u), h)


def test_the_inverse_branch_against_bisection():
    """g^-1 in 50 digits."""
    import mpmath

    a0, a, d_max = 0.01, [0.3, 0.0, 2.0], 3.0

    def g(d):
        return (1 - mpmath.exp(-d)) * (a0 + sum(c * d ** (2 * j + 1) for j, c in enumerate(a)))

    node = Node("c", "constraint_factor_inverse", {}, {"a0": a0, "a": a, "d_max": d_max})
    for v in (1e-12, 1e-5, 0.01, 0.5, 20.0, 200.0):
        with mpmath.workdps(50):
            exact = float(mpmath.findroot(lambda d, v=v: g(d) - 2 * mpmath.mpf(v), (0, d_max), solver="illinois")) / 2
        assert abs(Graph.single(node).run([0.0, v])[1] - exact) <= 4e-16 * max(exact, 1e-3)


def dead_zones(w0, r, w):
    """The operator and a bent readout in one chain: Kuhnen's modified Prandtl-Ishlinskii operator."""
    plays = Node("plays", "prandtl_ishlinskii", {}, {"w0": 1.0, "r": [0.1, 0.3], "w": [0.5, 0.25]})
    return Model("m", series(plays, Node("bend", "dead_zones", {}, {"w0": w0, "r": r, "w": w})))


@pytest.mark.parametrize(("w0", "r", "w"), [
    (1.0, [-0.5, -0.2, 0.3, 0.6], [0.5, -0.7, 2.0, -2.9]),
    (0.3, [0.4, -0.1, 0.4, 0.0], [-0.1, 0.2, 3.0, 0.2]),  # in no order, twice the same, one at 0
    (2.0, [0.0], [0.5]),
])  # fmt: skip
def test_dead_zones_behind_plays(w0, r, w):
    m = dead_zones(w0, r, w)
    u = signals.nested_reversals(60, 3)
    back = inverse(m)
    np.testing.assert_allclose(back.predict(m.predict(u)), u, rtol=0, atol=1e-14)
    np.testing.assert_allclose(m.predict(back.predict(u)), u, rtol=0, atol=1e-14)
    np.testing.assert_allclose(inverse(back).predict(u), m.predict(u), rtol=0, atol=1e-14)


@pytest.mark.parametrize(
    ("w0", "r", "w", "slope"),
    [(0.0, [0.1], [1.0], "0"), (1.0, [0.2, 0.1], [-0.6, -0.6], "-0.2"), (1.0, [-0.1, 0.0], [-2.0, 0.1], "-0.9")],
)
def test_dead_zones_that_fall_have_no_inverse(w0, r, w, slope):
    with pytest.raises(InputError, match=rf"'bend' must be increasing .* Got a slope .*{slope}\.$"):
        inverse(dead_zones(w0, r, w))


@pytest.mark.turn("inverses of fits")
def test_an_inverse_states_what_it_is_worth():
    """Against the cascade run here, on one of the signals."""
    m = fitted("zhao_tan_mlp", iterations=40, starts=1)
    made = inverse(m, "learned", iterations=40, N=8, hidden=5)
    assert (made.graph.node("bank").sizes["z"], made.graph.node("network").dims["n_hidden"]) == (8, 5)
    worth = made.fit
    r = m.predict(0.9 * signals.held_out()["nested reversals"])
    e = m.predict(made.predict(r)) - r
    assert 100 * np.abs(e).max() / np.ptp(r) <= worth["cascade_max_percent"] * (1 + 1e-12)
    assert 100 * np.sqrt(np.mean(e**2)) / np.ptp(r) <= worth["cascade_rms_percent"] * (1 + 1e-12)
    assert worth["cascade_max_percent"] < 10
    assert inverse(chain()).fit == {}  # the range of its input is unknown


@pytest.mark.turn("inverses of fits")
def test_identified_with_noise_its_inverse_linearises_the_true_plant():
    """S6: 0.1 % noise, at most 0.05 % of span in cascade with the plant itself, on held-out signals."""

    def plant(u):
        return plants.prandtl_ishlinskii(u) + 4

    inv = inverse(fitted(noise=1e-3, u=signals.training(150, 1), N=200))
    worst = nested_loops.cascade(inv, plant)
    assert 0.01 < worst["max_percent"] <= 0.05
    u = 0.9 * signals.held_out()["two tones"]
    e = plant(inv.predict(plant(u))) - plant(u)
    assert 100 * np.abs(e).max() / np.ptp(plant(u)) <= worst["max_percent"] * (1 + 1e-12)


@pytest.mark.stress
def test_learned_inverse_of_ten_backlashes_by_the_recipe_of_the_papers():
    """A network of ten backlashes with a linear term: at most 2 % on held-out signals; its choices saw others."""
    record = nested_loops.recorded(zhao_tan_2008.actuator(zhao_tan_2008.LINEAR), 200)
    model = fit(record, "zhao_tan_mlp", starts=1)
    made = inverse(model, "learned")
    assert made.fit["cascade_max_percent"] <= 2
    assert made.provenance["inverse"] == "learned"
    assert made.provenance["of"] == model.provenance
    assert any(n.type == "zhao_tan_inverse" for n in made.graph.nodes)
    assert "warnings" not in made.fit


@pytest.mark.turn("inverses of fits")
def test_a_model_that_falls_against_its_input_is_warned_of():
    record = nested_loops.recorded(zhao_tan_2008.actuator(), 60)  # without linear term
    seen: list[float] = []
    model = fit(record, "zhao_tan_mlp", starts=1, iterations=40)
    made = inverse(model, "learned", progress=seen.append, iterations=5, starts=1)
    assert seen == sorted(seen)
    assert 0 <= seen[0] < 0.5 <= seen[-1] <= 1
    assert "moves against its input" in made.fit["warnings"][0]


@pytest.mark.parametrize(("make", "words"), [
    (lambda: plays_only(), ("'w0' parameter of p must be greater than 0", "slope 0 after each reversal", "w0_min")),
    (lambda: fitted("zhao_tan_mlp", iterations=10, starts=1), ("mlp", "no exact inverse", "learned")),
    (lambda: fitted("preisach", n=6, widths=4, means=2, rate="yes"), ("no exact inverse", "'implicit' or 'learned'")),
    (lambda: chain(memory="last"), ("'last'", "dominant")),
    (lambda: falling(), ("must be increasing", "Got -0.5 instead")),
    (lambda: flat(), ("at c:", "must rise")),
    (lambda: straight(0.0), ("'gain' parameter of s must not be 0",)),
    (lambda: two_scalings("a.u", "b.u"), ("form one chain", "Got another structure")),
    (lambda: two_scalings("a.u"), ("form one chain", "Got another structure")),
])  # fmt: skip
def test_where_no_exact_inverse_exists_the_reason_is_said(make, words):
    with pytest.raises(InputError) as e:
        inverse(make())
    for w in words:
        assert w in str(e.value)


@pytest.mark.turn("inverses of fits")
@pytest.mark.some(1)
@pytest.mark.parametrize(("key", "static", "options"), [
    ("rate_mlp", False, {"starts": 1, "iterations": 5, "N": 4}),
    ("preisach", True, {"n": 12, "widths": 8, "means": 3}),
])  # fmt: skip
def test_the_hint_names_only_methods_that_work(key, static, options):
    """A difference over a step has no implicit inverse."""
    model = fitted(key, **options)
    with pytest.raises(InputError, match="no exact inverse") as e:
        inverse(model)
    assert ("'implicit'" in str(e.value)) == static
    if static:
        inverse(model, "implicit")
    else:
        with pytest.raises(InputError, match="on the sample time"):
            inverse(model, "implicit")
    inverse(model, "learned", iterations=5, starts=1)
    with pytest.raises(InputError, match="span_u") as e:
        inverse(replace(model, provenance={}))
    assert "implicit" not in str(e.value)


def two_scalings(*to):
    """Two that take the input, or one after the other; the output is that of the first one."""
    wires = [] if "b.u" in to else [("a.y", "b.u")]
    nodes = [Node("a", "scaling"), Node("b", "scaling")]
    return Model("b", Graph(nodes, wires, [Input("u", to)], [Output("y", "a.y")]))


def scheduled(lo, hi):
    """Plays times -2 + 8 T for T in [lo, hi], plus 0.6 T - 0.5."""
    nodes = [
        Node("plays", "prandtl_ishlinskii", {}, {"w0": 1.0, "r": [0.1, 0.3], "w": [0.5, 0.25]}),
        Node("limited", "scaling", {"n": 1}, {"gain": -2.0, "offset": 0.5, "lo": lo, "hi": hi}),
        Node("factor", "sum", {"n": 1}, {"k": [-4.0]}),
        Node("scheduled", "product", {"n": 2, "m": 0}),
        Node("added", "sum", {"n": 2}, {"k": [-0.3, 2.0], "offset": -0.35}),
    ]
    wires = [("limited.y", "factor.u"), ("factor.y", "scheduled.u[1]"), ("plays.y", "scheduled.u[2]")]
    wires += [("limited.y", "added.u[1]"), ("scheduled.y", "added.u[2]")]
    graph = Graph(nodes, wires, [Input("u", ("plays.u",)), Input("T", ("limited.u",))], [Output("y", "added.y")])
    return Model("s", graph, None, "", {}, {"span_covariates": {"T": [lo, hi]}})


@pytest.mark.parametrize(("lo", "hi"), [(0.5, 1.0), (0.0, 0.125)])
def test_sums_and_products_with_a_covariate_are_solved_for_the_signal(lo, hi):
    m = scheduled(lo, hi)
    u, T = signals.nested_reversals(40, 3), np.linspace(lo, hi, len(signals.nested_reversals(40, 3)))
    found = inverse(m).graph.run(np.column_stack([m.graph.run(np.column_stack([u, T])), T]))
    np.testing.assert_allclose(found, u, rtol=0, atol=1e-13)


@pytest.mark.parametrize(("lo", "hi", "reach"), [(0.25, 1.0, "0 to 6"), (0.0, 0.25, "-2 to 0"), (0.0, 1.0, "-2 to 6")])
def test_a_factor_that_may_be_0_has_no_inverse(lo, hi, reach):
    with pytest.raises(
        InputError, match=f"factor.y of scheduled must keep its sign for an inverse. Got one from {reach}"
    ):
        inverse(scheduled(lo, hi))


def plays_only():
    return Model("p", Graph.single(Node("p", "prandtl_ishlinskii", {}, {"w0": 0.0, "r": [0.1, 0.2], "w": [1.0, 2.0]})))


def flat():
    values = {"a0": 0.0, "a": [0.0]}
    return Model("c", Graph.single(Node("c", "constraint_factor", {}, values)))


def falling():
    return Model("p", Graph.single(Node("p", "prandtl_ishlinskii", {}, {"w0": 1.0, "r": [0.1, 0.2], "w": [-1.5, 2.0]})))


def test_a_least_linear_weight_makes_a_model_invertible():
    u = signals.training(30, 1)
    data = Dataset.from_signal(u, plants.plays(u, plants.R) @ plants.W)
    assert fit(data, "prandtl_ishlinskii", w0_min=0.2).graph.node("hysteresis").value("w0")[0] >= 0.2
    inverse(fit(data, "prandtl_ishlinskii", w0_min=0.2))


def test_unknown_method_and_option():
    with pytest.raises(InputError, match="exact, implicit, learned"):
        inverse(fitted(), "best")
    with pytest.raises(InputError, match=r"The options of the .* inverse must be among: .*\. Got 'N' instead"):
        inverse(fitted(), N=3)
    with pytest.raises(InputError, match="span_u"):
        inverse(chain(), "learned")


# ---- parts of inverses by numbers ------------------------------------------------------------------------------------
def straight(gain=1.0):
    return Model(
        "s", Graph.single(Node("s", "scaling", {"n": 1}, {"gain": gain})), 1e-3, "", {}, {"span_u": [-1.0, 1.0]}
    )


@pytest.mark.parametrize(("first", "second", "taken"), [(1.035, None, 1.035), (1.05, 1.045, 1.045), (1.05, 1.1, 1.05)])
def test_a_second_network_is_trained_after_a_poor_one_and_the_better_one_stays(monkeypatch, first, second, taken):
    def training(gain):
        def train(model, u, y, seed, options, progress):
            progress(0.5)
            return straight(gain)

        return train

    seen = []
    monkeypatch.setattr(learned, "_corrected", training(first))
    monkeypatch.setattr(learned, "_direct", training(second))
    assert learned.learned_inverse(straight(), 3, {}, seen.append).graph.node("s").value("gain")[0] == taken
    assert seen == ([0.25] if second is None else [0.25, 0.75])


def test_what_a_learned_inverse_is_chosen_by():
    found = learned._validation(straight(), 5)
    shapes = [signals.decaying_sine(10, 0.12), signals.two_tones(10, 2.9, 0.3), signals.nested_reversals(60, 4716)]
    for r, v in zip(found, [*shapes, signals.minor_loops(5, 0.3)], strict=True):
        assert r[-len(v) :] == pytest.approx(0.9 * v, abs=1e-12)
    assert learned._largest(straight(), straight(1.1), [np.array([0.0, 2, -2]), np.array([1.0, 3])]) == pytest.approx(
        0.15
    )
    lost = SimpleNamespace(predict=lambda r: r * np.nan, step=None)
    assert learned._largest(lost, straight(), [np.array([0.0, 1])]) == np.inf


@pytest.mark.parametrize(("falling", "warned"), [(0, False), (5, False), (6, True)])
def test_rows_on_which_the_output_falls(falling, warned):
    u = np.linspace(0, 1, 101)
    top = u[100 - falling]
    y = np.minimum(u, 2 * top - u)
    for sign in (1, -1):
        lines = learned._falls(u, sign * y)
        assert ["against its input on 6 % of the rows" in line for line in lines] == [True] * warned


def test_a_learned_inverse_corrects_the_wanted_output_by_operators_of_three_scales():
    m = fitted()
    u = over_range(m, signals.training(20, 1))[7:]
    y = m.predict(u)
    made = learned._corrected(m, u, y, 2, {"iterations": 1, "starts": 1}, lambda part: None)
    gains = np.array([made.graph.node(f"scale{k}").value("gain")[0] for k in (1, 2, 3)])
    assert gains * np.ptp(y) == pytest.approx([0.5, 1.0, 2.0])
    assert [made.graph.node(f"scale{k}").value("offset")[0] for k in (1, 2, 3)] == pytest.approx(-gains * y[0])
    bank = made.graph.node("bank")
    assert (bank.sizes["z"], set(bank.value("z0"))) == (4, {y[0]})
    inputs = [
        "input.y",
        "first_hysteresis.u",
        *(f"operator{k}.x" for k in (1, 2, 3)),
        *(f"bank.z[{k}]" for k in (1, 2, 3, 4)),
    ]
    assert [a for a, b in made.graph.wires if b.startswith("features.u")] == inputs
    assert made.graph.node("last_hysteresis").value("w0") == pytest.approx(m.graph.node("hysteresis").value("w0"))
    assert made.fit["parameters"] == 12 * 9 + 12 + 12 + 1 + 9 + 1 + 41  # network, linear part, plays
    assert made.fit["rms_percent"] < 1
    told = made.provenance
    assert (told["rows"], told["span_u"], told["seed"]) == (len(u), [y.min(), y.max()], 2)
    assert (told["options"]["N"], told["options"]["hidden"], told["options"]["decay"]) == (4, 12, 1e-8)


@pytest.mark.parametrize(("flat", "refused"), [((0.9, 1.1), True), ((0.6, 0.9), False), ((0.9998, 1.1), True)])
def test_an_implicit_inverse_needs_an_output_that_turns_in_the_middle_of_the_range(flat, refused):
    curve = Node("c", "dead_zones", {}, {"w0": 1.0, "r": list(flat), "w": [-1.0, 1.0]})
    with pytest.raises(InputError, match="must change directly after a reversal") if refused else nullcontext():
        inverse(Model("c", Graph.single(curve)), "implicit", lo=0.0, hi=2.0)


def test_the_way_into_a_range():
    m = replace(straight(), provenance={"span_u": [2.0, 6.0]})
    found = over_range(m, np.array([0.5, -1.0, 1.0]))
    assert (found[0], found[-3:].tolist()) == (0.0, [5.0, 2.0, 6.0])
    assert (np.diff(found[:-2]) > 0).all()
    assert over_range(replace(m, provenance={"span_u": [2.0, 2.0]}), np.array([0.5, -1.0])).tolist() == [2.0, 2.0]
    for span in (None, [1.0], [1.0, 2.0, 3.0], "12"):
        with pytest.raises(InputError, match=r"provenance\.span_u = \[min, max\]\. Got "):
            over_range(replace(m, provenance={"span_u": span}), np.zeros(2))


def test_what_auto_asks_of_the_inverses():
    sum_of_both = Graph(
        [Node("b", "bouc_wen"), Node("s", "sum", {"n": 2}, {"k": [2.0, 1.0]})],
        [("b.z", "s.u[2]")],
        [Input("u", ("b.u", "s.u[1]"))],
        [Output("y", "s.y")],
    )
    span = {"span_u": [-1.0, 1.0]}
    lag = Graph.single(Node("g", "transfer_function", {}, {"b": [1.0, 1.0], "a": [1.0, 2.0]}))
    implicit, lagging = (Model("b", graph, 1e-3, "", {}, span) for graph in (sum_of_both, lag))
    assert [Inverses().kind(m) for m in (straight(), implicit, lagging)] == ["exact", "implicit", "learned"]
    assert Inverses().fault(straight()) == Inverses().fault(implicit) == ""
    for slope, kind in ((-1e-5, "exact"), (-1e-3, "none: not monotone")):  # of the last half
        curve = Node("c", "dead_zones", {}, {"w0": 1.0, "r": [0.5], "w": [slope - 1.0]})
        bent = Model("c", Graph.single(curve), None, "", {}, span)
        assert Inverses().kind(bent).replace("implicit", "exact") == kind
        assert ("not monotone in the input" in Inverses().fault(bent)) == (slope == -1e-3)
    lower = inverse(implicit, "implicit", lo=-2.0).graph.node("inverse")
    assert (lower.value("lo")[0], lower.value("hi")[0]) == (-2.0, 1.0)
    wide = Node("k", "krasnoselskii_pokrovskii", {}, {"w": np.eye(10)[3]})
    relays = Model("k", Graph.single(wide), None, "", {}, span)
    for flat in (
        replace(plays_only(), provenance=span),
        relays,
    ):  # no advice of a learned inverse, which a loop refuses
        assert Inverses().fault(flat).endswith("w0_min > 0) and no dead band, or another kind of model.")
