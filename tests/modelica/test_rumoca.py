"""What users are told about bad parameters; the compiler of the tests after a crash."""

from pathlib import Path

import library
import pytest
import simulate


def complaint(source: str, folder: Path) -> str:
    """What rumoca says about compiling and simulating the model M of `source`."""
    file = folder / "M.mo"
    file.write_text(source)
    packages = [library.ROOT] if "HystFMU" in source else []  # reading the library takes longer than such a model
    return simulate.rumoca(file, "M", "0.3", "0.1", "1e-6", folder / "r.npz", packages=packages)


@pytest.mark.some(1)
@pytest.mark.parametrize(("component", "inputs", "message"), [
    ("Operators.Sampled.PrandtlIshlinskii a(n = 2, depth = 4, r = {0.2, 0.1})", "u", "thresholds r must not decrease"),
    ("Inverse.Sampled.PrandtlIshlinskiiInverse a(n = 2, depth = 4, r = {0.2, 0.1})", "y",
     "thresholds r must not decrease"),
    ("Inverse.Sampled.PrandtlIshlinskiiInverse a(n = 1, depth = 4, w0 = 1, w = {-1})", "y", "must be greater than 0"),
    ("Operators.Sampled.BoucWen a(beta = 0.5, gamma = -0.5)", "u", "beta + gamma must be greater than 0"),
    ("Operators.Sampled.BoucWen a(z0 = 1.1)", "u", "z0) must be at most"),
    ("Operators.Smooth.PrandtlIshlinskii a(n = 1, r = {1e-6}, width = 1e-3)", "u du", "width must be greater than 0"),
    ("Operators.Smooth.PlayBank a(n = 1, r = {1e-6}, width = 0)", "u du", "width must be greater than 0"),
    ("Operators.Smooth.ZhaoTan a(width = 3)", "x dx", "reach must be greater than 0"),
    ("Operators.Smooth.KrasnoselskiiPokrovskii a(width = 2)", "u du", "width must be between 0 and 1"),
    ("Control.SlidingMode a(u_min = 1, u_max = -1)", "y_d y u_ff", "u_min must not be greater"),
    ("Control.Pid a(u_min = 1, u_max = -1)", "y_d y u_ff", "u_min must not be greater"),
    ("Control.DisturbanceObserver a(gain = 0)", "u_c y", "gain must not be 0"),
    ("Dynamics.TransferFunction a(a = {1, 0}, start = HystFMU.Types.Start.steady)", "u", "has no steady state"),
])  # fmt: skip
def test_bad_parameters_are_refused(component: str, inputs: str, message: str, tmp_path: Path) -> None:
    equations = " ".join(f"a.{u} = 0.1*time;" for u in inputs.split())
    assert message in complaint(f"model M HystFMU.{component}; equation {equations} end M;", tmp_path)


@pytest.mark.stress
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
