"""What users are told about bad parameters, and what rumoca 0.10.2 cannot do, in its words."""

from __future__ import annotations

from pathlib import Path

import library
import numpy as np
import pytest
import simulate


def complaint(source: str, folder: Path) -> str:
    """What rumoca says about compiling and simulating the model M of `source`."""
    file = folder / "M.mo"
    file.write_text(source)
    packages = [library.ROOT] if "HystFMU" in source else []  # reading the library takes longer than such a model
    return simulate.rumoca(file, "M", "0.3", "0.1", "1e-6", folder / "r.npz", packages=packages)


@pytest.mark.parametrize(
    ("component", "inputs", "message"),
    [
        (
            "Operators.Sampled.PrandtlIshlinskii a(n = 2, depth = 4, r = {0.2, 0.1})",
            "u",
            "thresholds r must not decrease",
        ),
        (
            "Inverse.Sampled.PrandtlIshlinskiiInverse a(n = 2, depth = 4, r = {0.2, 0.1})",
            "y",
            "thresholds r must not decrease",
        ),
        (
            "Inverse.Sampled.PrandtlIshlinskiiInverse a(n = 1, depth = 4, w0 = 1, w = {-1})",
            "y",
            "must be greater than 0",
        ),
        ("Operators.Sampled.BoucWen a(beta = 0.5, gamma = -0.5)", "u", "beta + gamma must be greater than 0"),
        ("Operators.Sampled.BoucWen a(z0 = 1.1)", "u", "z0 must be within"),
        (
            "Operators.Smooth.PrandtlIshlinskii a(n = 1, r = {1e-6}, width = 1e-3)",
            "u du",
            "width must be greater than 0",
        ),
        ("Operators.Smooth.PlayBank a(n = 1, r = {1e-6}, width = 0)", "u du", "width must be greater than 0"),
        ("Operators.Smooth.ZhaoTan a(width = 3)", "x dx", "reach must be greater than 0"),
        ("Operators.Smooth.KrasnoselskiiPokrovskii a(width = 2)", "u du", "width must be between 0 and 1"),
        ("Control.SlidingMode a(u_min = 1, u_max = -1)", "y_d y u_ff", "u_min must not be greater"),
        ("Control.Pid a(u_min = 1, u_max = -1)", "y_d y u_ff", "u_min must not be greater"),
        ("Control.DisturbanceObserver a(gain = 0)", "u_c y", "gain must not be 0"),
        ("Dynamics.TransferFunction a(a = {1, 0}, start = HystFMU.Types.Start.steady)", "u", "has no steady state"),
    ],
)
def test_bad_parameters_are_refused(component: str, inputs: str, message: str, tmp_path: Path) -> None:
    equations = " ".join(f"a.{u} = 0.1*time;" for u in inputs.split())
    assert message in complaint(f"model M HystFMU.{component}; equation {equations} end M;", tmp_path)


WHEN = "discrete Real z[2](each start = 0, each fixed = true); equation when sample(0, 0.1) then {} end when;"
FUNCTION = (
    "function f input Real m[:]; output Real y[size(m, 1)]; protected Integer count = integer(m[1]); Integer i; "
    "algorithm y := m; i := 1; {} end f; "
    "model M discrete Real z[4](start = {{1, 2, 3, 4}}, each fixed = true); "
    "equation when sample(0, 0.1) then z = f(pre(z)); end when; end M;"
)
LIMITS = {
    "elements of a discrete array assigned one by one in a when-equation": (
        "model M " + WHEN.format("z[1] = time; z[2] = time;") + " end M;",
        "`z[1]` is not a discrete coordinate",
    ),
    "while whose end depends on data": (
        FUNCTION.format("while i < m[4] loop i := i + 1; end while;"),
        "contains a statement without a checked DAE owner",
    ),
    "for whose range depends on data": (
        FUNCTION.format("for k in count:2 loop y[k] := m[k + 2]; end for;"),
        "scalar statement expansion is prohibited",
    ),
    "break": (
        FUNCTION.format("for k in 1:4 loop if m[k] > 2 then break; end if; i := i + 1; end for;"),
        "does not have a proved finite arithmetic-series form",
    ),
    "return": (
        FUNCTION.format("if m[1] > 1 then return; end if; y[1] := 2;"),
        "must define every output before returning",
    ),
    "function as an argument": (
        "partial function G input Real x; output Real y; end G; function g extends G; algorithm y := x; end g; "
        "function f input G h; input Real x; output Real y; algorithm y := h(x); end f; "
        "model M Real y; equation y = f(g, time); end M;",
        "cannot be used as a value",
    ),
    "derivative of an expression": (
        "model M Real x(start = 0, fixed = true); Real z; equation der(x) = 1; z = der(2*x + 1); end M;",
        "der(...) must have exactly one resolved variable-reference operand",
    ),
    "array-valued call as modifier of an array of components": (
        "model A parameter Real r = 1; Real y; equation y = r*time; end A; "
        "model M A a[3](r = linspace(1, 2, 3)); end M;",
        "expression shape mismatch",
    ),
    "external C": (
        'function f input Real x; output Real y; external "C" y = sin(x); end f; '
        "model M Real y; equation y = f(time); end M;",
        "which this runtime cannot execute",
    ),
    "scalar parameter that a function computes from an array of a parameter's size, before an element of an array": (
        "function f input Real a[:]; output Real s; algorithm s := 2*a[1]; end f; "
        "model M parameter Integer n = 2; parameter Real a[n + 1] = {1, 2, 3}; parameter Real s = f(a); "
        "Real v[n](each start = 0, each fixed = true); equation der(v[1]) = s*v[2]; der(v[2]) = s*time; end M;",
        "unbalanced model",
    ),
    "port that is connected to an element of an array whose other elements depend on it": (
        "connector I = input Real; connector O = output Real; block R O r; equation r = time; end R; "
        "block S I u; O y; protected discrete Real q(start = 0, fixed = true); "
        "equation when sample(0, 0.1) then q = 0.5*pre(q) + u; end when; y = q; end S; "
        "block V I u[2]; O y; equation y = u[1] + u[2]; end V; block B I u; O y; S lag; V two; "
        "equation connect(u, lag.u); connect(u, two.u[1]); connect(lag.y, two.u[2]); connect(two.y, y); end B; "
        "model M B b; R r; equation connect(r.r, b.u); end M;",
        "which is causally reachable from that same target during the tick",
    ),
    "external object": (
        'class E extends ExternalObject; function constructor output E e; external "C" e = mk(); end constructor; '
        'function destructor input E e; external "C" rm(e); end destructor; end E; '
        "model M E e = E(); Real y = time; end M;",
        "has unsupported type `E`",
    ),
    "operators of clocked variables outside a clocked when": (
        "model M Real u = time; Real y(start = 0); "
        "equation when Clock(0.1) then y = sample(u) + previous(y); end when; end M;",
        "unsupported runtime operator `previous`",
    ),
    "inner and outer": (
        "model A outer Real g; Real y = g*time; end A; model M inner Real g = 2; A a; end M;",
        "unbalanced model: 2 equations, 3 unknowns",
    ),
    "spatialDistribution": (
        "model M Real a, b; equation (a, b) = spatialDistribution(time, 0, time, true, {0, 1}, {0, 0}); end M;",
        "unresolved Flat reference `spatialDistribution`",
    ),
    "strings joined at run time": (
        'model M parameter String s = "a" + "b"; Real y = time; equation assert(s == "ab", s); end M;',
        "String values are not numeric",
    ),
    "one variable in the branches of two samples": (
        "model M discrete Real z(start = 0, fixed = true); "
        "equation when sample(0, 0.1) then z = 1; elsewhen sample(0.05, 0.1) then z = 2; end when; end M;",
        "is already owned by clock identity 0",
    ),
    "initial equation of a state behind a variable that an event sets": (
        "model M discrete Real u(start = 1, fixed = true); Real v; initial equation v = u; "
        "equation when {initial(), time > 0.1} then u = 1 + time; end when; der(v) = u - v; end M;",
        "initial variable projection did not satisfy the complete residual system",
    ),
}


@pytest.mark.parametrize("limit", LIMITS)
def test_known_limit_of_rumoca_still_stands(limit: str, tmp_path: Path) -> None:
    """When this fails, rumoca has learnt something: the library may become simpler."""
    source, message = LIMITS[limit]
    assert message in complaint(source, tmp_path)


SILENT = """
function g input Real u; output Real y; algorithm y := u; end g;
function twice input Real u; output Real y; algorithm y := 2*u; end twice;
function lost input Real u[2]; output Real y; protected Real w[2];
algorithm
  y := 0;
  if u[1] > 0 then
    for i in 1:2 loop w[i] := u[i]; end for;
    y := w[2];
  end if;
end lost;
block A
  replaceable function f = g;
  function h input Real u; output Real y; algorithm y := f(u); end h;
  Real y(start = 0, fixed = true);
equation when sample(0, 0.1) then y = h(1 + time); end when; end A;
model M A a(redeclare function f = twice); Real y(start = 0, fixed = true);
equation when sample(0, 0.1) then y = lost({1, 2 + time}); end when; end M;
"""


def test_what_rumoca_gets_wrong_without_a_word_still_is(tmp_path: Path) -> None:
    """The rules of lint_silent.py stand for this; when it fails, rumoca has learnt something."""
    assert complaint(SILENT, tmp_path) == ""
    with np.load(tmp_path / "r.npz") as found:
        assert found["a.y"][0] == 1.0  # twice(1) is 2
        assert found["y"][-1] == 0.0  # should be above 2


def test_compiler_starts_anew_after_a_crash_and_a_hang(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A model after one that crashes the compiler or never ends is simulated normally."""
    compiler = simulate.Compiler()
    monkeypatch.setattr(simulate, "COMPILER", compiler)
    sound = "model M Real y = time; end M;"
    assert complaint(sound, tmp_path) == ""
    assert compiler.process is not None
    compiler.process.kill()
    assert complaint(sound, tmp_path) == "exit status -9"
    assert complaint(sound, tmp_path) == ""
    monkeypatch.setattr(simulate, "TIME_LIMIT", 0.0)
    assert complaint(sound, tmp_path) == "exit status -9"
    monkeypatch.setattr(simulate, "TIME_LIMIT", 900.0)
    assert complaint(sound, tmp_path) == ""
    compiler.end()
