"""A foreign FMU runs alone: closed forms for every version, interface and type of variable."""

import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from invoked import invoked
from reference_fmus import reference_fmu
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from hystfmu import Graph, Input, InputError, Node, Output
from hystfmu.fmu import export_fmu
from hystfmu.scenario.run_fmu import run_fmu


def exchange_only(given: Path, out: Path, edit: Callable[[str], str] = str) -> Path:
    """Copy an FMU without its Co-Simulation."""
    with zipfile.ZipFile(given) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "modelDescription.xml":
                text = re.sub(r"<CoSimulation\b(?:[^>]*/>|.*?</CoSimulation>)", "", content.decode(), flags=re.S)
                content = edit(text).encode()
            new.writestr(name, content)
    return out


def of_model(name: str, tmp_path: Path) -> Path:
    """The Model Exchange of a Reference FMU."""
    path = reference_fmu(name)
    return path if name.startswith("fmi1") else exchange_only(path, tmp_path / "x.fmu")


def of_all(model: str, first: str) -> list[Any]:
    """A Reference FMU in all versions; FMI 2.0 is called as FMI 3.0 is, and waits for the long runs."""
    return [f"{first}/{model}", pytest.param(f"fmi2/{model}", marks=pytest.mark.stress), f"fmi3/{model}"]


@pytest.mark.turn("a foreign FMU alone")
@pytest.mark.some(1)
@pytest.mark.parametrize("fmi", [3, pytest.param(2, marks=pytest.mark.stress)])
def test_model_exchange_of_a_lag_follows_its_closed_form(tmp_path: Path, fmi: int) -> None:
    """y' = (u - y)/T with an input held over each step; the rows of the file lie between the steps."""
    T, h = 0.05, 0.01
    graph = Graph.single(Node("lag", "transfer_function", {"na": 1, "nb": 0}, {"b": [1.0], "a": [T, 1.0]}))
    export_fmu(graph.with_step(1e-3), tmp_path / "lag.fmu", fmi=fmi)  # type: ignore[arg-type]
    path = exchange_only(tmp_path / "lag.fmu", tmp_path / "me.fmu")
    (tmp_path / "in.csv").write_text("Zeit [ms];u\n0;1,0\n500;3,5\n1000;-0,5\n")
    run = run_fmu(path, tmp_path / "in.csv", step=h)
    t = run.t
    assert (len(t), t[-1]) == (101, 1.0)
    u = np.interp(t, [0, 0.5, 1.0], [1.0, 3.5, -0.5])
    y = [0.0]
    for k in range(100):
        y.append(u[k] + (y[-1] - u[k]) * np.exp(-h / T))
    assert np.abs(run.values["y"] - y).max() < 1e-7


@pytest.mark.some(1)
@pytest.mark.parametrize("name", of_all("Dahlquist", "fmi1me"))
def test_dahlquist(tmp_path: Path, name: str) -> None:
    run = run_fmu(of_model(name, tmp_path), settings={"k": 2.5}, step=0.25, stop=10.0)
    assert np.abs(run.values["x"] - np.exp(-2.5 * run.t)).max() < 3e-8


@pytest.mark.some(0.5)
@pytest.mark.parametrize("name", of_all("Dahlquist", "fmi1cs"))
def test_dahlquist_steps_by_its_own_euler_in_co_simulation(name: str) -> None:
    run = run_fmu(reference_fmu(name), step=0.1, stop=5.0)
    assert np.abs(run.values["x"] - 0.9 ** np.arange(51)).max() < 1e-14


@pytest.mark.turn("a foreign FMU alone")
@pytest.mark.some(1)
@pytest.mark.parametrize("name", of_all("BouncingBall", "fmi1me"))
def test_bouncing_ball_meets_the_times_of_its_bounces(tmp_path: Path, name: str) -> None:
    """The ball falls from 1 m; bounce k follows the one before after 2 e^k v_1/g."""
    g, e = 9.81, 0.7
    run = run_fmu(of_model(name, tmp_path), step=0.01, stop=2.0)
    at, v = np.sqrt(2 / g), np.sqrt(2 * g)
    height = np.where(run.t < at, 1 - g / 2 * run.t**2, 0.0)
    speed = np.where(run.t < at, -g * run.t, 0.0)
    for _ in range(8):
        v *= e
        flying = (run.t >= at) & (run.t < at + 2 * v / g)
        s = run.t - at
        height = np.where(flying, v * s - g / 2 * s**2, height)
        speed = np.where(flying, v - g * s, speed)
        at += 2 * v / g
    assert np.abs(run.values["h"] - height).max() < 1e-8
    assert np.abs(run.values["v"] - speed).max() < 1e-7


@pytest.mark.some(0.5)
@pytest.mark.parametrize("name", of_all("Stair", "fmi1me"))
def test_time_events_and_a_designed_end(tmp_path: Path, name: str) -> None:
    run = run_fmu(of_model(name, tmp_path), step=0.25, stop=20.0)
    assert run.values["counter"].tolist() == (1 + np.floor(run.t)).tolist()
    assert (run.t[-1], run.note) == (8.75, "the FMU ends the simulation at 9 s")


@pytest.mark.some(0.5)
@pytest.mark.parametrize("name", of_all("Stair", "fmi1cs"))
def test_stair_in_co_simulation(name: str) -> None:
    run = run_fmu(reference_fmu(name), step=0.2, stop=8.0)
    assert run.values["counter"].tolist() == (1 + np.floor(run.t + 1e-9)).tolist()


@pytest.mark.some(1)
@pytest.mark.parametrize("name", of_all("VanDerPol", "fmi1me"))
def test_van_der_pol_agrees_with_another_integrator(tmp_path: Path, name: str) -> None:
    run = run_fmu(of_model(name, tmp_path), step=0.5, stop=20.0)
    want = solve_ivp(
        lambda t, x: [x[1], (1 - x[0] ** 2) * x[1] - x[0]], (0, 20), [2, 0], "DOP853", run.t, rtol=1e-12, atol=1e-13
    )
    assert np.abs(np.array([run.values["x0"], run.values["x1"]]) - want.y).max() < 1e-6


def test_arrays_sized_by_structural_parameters(tmp_path: Path) -> None:
    """x' = A x + B u and y = C x + D u with constant u; all sizes differ from those in the file."""
    A = np.array([[-1.0, 2.0], [-2.0, -0.5]])
    sizes = {"m": 2, "n": 2, "r": 2}
    settings = sizes | {"A": A.ravel().tolist(), "B": [1.0, 0, 0, 1], "C": [1.0, 0, 0, 1], "D": [0.5, 0, 0, 0]}
    (tmp_path / "in.csv").write_text("t,u_1,u_2\n0,1.5,-0.25\n1,1.5,-0.25\n")
    path = exchange_only(reference_fmu("fmi3/StateSpace"), tmp_path / "me.fmu")
    run = run_fmu(path, tmp_path / "in.csv", settings, step=0.1, stop=2.0)
    u = np.array([1.5, -0.25])
    rest = -np.linalg.solve(A, u)
    x = np.array([rest - expm(A * t) @ rest for t in run.t])
    assert list(run.values) == ["y_1", "y_2"]
    assert np.abs(run.values["y_1"] - (x[:, 0] + 0.5 * u[0])).max() < 1e-7
    assert np.abs(run.values["y_2"] - x[:, 1]).max() < 1e-7
    with pytest.raises(InputError, match=r"A: must have 4 elements; got 9"):
        run_fmu(path, settings=sizes | {"A": [0.0] * 9})


TYPES = {
    "Float32_continuous": "1.5", "Float64_discrete": "-2.25", "Int8": "-128", "UInt8": "255", "Int16": "-32768",
    "UInt16": "65535", "Int32": "-2147483648", "UInt32": "4294967295", "Int64": "-9007199254740992",
    "UInt64": "9007199254740992", "Boolean": "1", "Enumeration": "2",
}  # fmt: skip


@pytest.mark.turn("a foreign FMU alone")
@pytest.mark.some(1)
@pytest.mark.parametrize("interface", ["Co-Simulation", "Model Exchange"])
def test_every_type_of_variable(tmp_path: Path, interface: str) -> None:
    """The values of the second row count from 0.5 s on; only the continuous input is on a line before."""
    path = reference_fmu("fmi3/Feedthrough")
    if interface == "Model Exchange":
        path = exchange_only(path, tmp_path / "me.fmu")
    rows = [["t", *(f"{n}_input" for n in TYPES)], ["0", *("1" if n == "Enumeration" else "0" for n in TYPES)]]
    rows.append(["0.5", *TYPES.values()])
    (tmp_path / "in.csv").write_text("\n".join(",".join(r) for r in rows) + "\n")
    run = run_fmu(path, tmp_path / "in.csv", step=0.125, stop=1.0)
    for name, text in TYPES.items():
        y = run.values[f"{name}_output"]
        begin = 1.0 if name == "Enumeration" else 0.0
        before = np.arange(5) / 4 * 1.5 if name == "Float32_continuous" else np.full(5, begin)
        # an input of row k is held in the step that row k + 1 ends
        want = [before[0], *before[:4], *[float(text)] * 4]
        assert y.tolist() == want, name


@pytest.mark.some(1)
@pytest.mark.parametrize(("cell", "message"), [
    ("Int8_input\n0,200", "Int8_input: 200 does not fit the type Int8"),
    ("UInt16_input\n0,-1", "UInt16_input: -1 does not fit the type UInt16"),
    ("Int32_inputs\n0,1", "'Int32_inputs' is no input of"),
])  # fmt: skip
def test_a_value_that_cannot_be_carried_is_refused(tmp_path: Path, cell: str, message: str) -> None:
    (tmp_path / "in.csv").write_text(f"t,{cell}\n")
    with pytest.raises(Exception, match=message):
        run_fmu(reference_fmu("fmi3/Feedthrough"), tmp_path / "in.csv")


@pytest.mark.parametrize(("text", "said"), [
    ("a,b\n1,2\n2,3\n", "a column of time is needed, named t or time; there are 'a', 'b'"),
    ("t [m],v\n1,2\n2,3\n", "the time must be in s, "),
    ("t,z\n1,2\n2,3\n", "'z' is no input of {}; there are v, u_1, u_2"),
    ("t,u_1\n1,2\n2,3\n", "the input 'u' needs columns for all elements; 'u_2' is missing"),
    ("t,v\n1,2\n0.5,3\n", "the times must not decrease, and the table must have a row"),
])  # fmt: skip
def test_a_table_that_does_not_fit(pair: Path, text: str, said: str) -> None:
    table = pair.with_name("u.csv")
    table.write_text(text)
    with pytest.raises(InputError) as e:
        run_fmu(pair, table)
    assert str(e.value).startswith(f"{table}: {said.format(pair)}")


@pytest.fixture
def pair(tmp_path: Path) -> Path:
    """Two inputs u, doubled and negated, and a gain of an input v; an array in FMI 3.0."""
    nodes = [Node("pair", "scaling", {"n": 2}, {"gain": [2.0, -1.0]}), Node("one", "scaling", {"n": 1})]
    inputs, outputs = [Input("v", ("one.u",)), Input("u", ("pair.u",))], [Output("y", "pair.y"), Output("z", "one.y")]
    return export_fmu(Graph(nodes, [], inputs, outputs).with_step(0.5), tmp_path / "pair.fmu", fmi=3, stop=2.0)


@pytest.mark.turn("a foreign FMU alone")
def test_columns_become_inputs_in_the_order_of_their_elements(pair: Path) -> None:
    """Times in ms; what a row says at a communication point holds in the step that begins there."""
    table = pair.with_name("u.csv")
    table.write_text("u_2,t [ms],v,u_1\n1,0,10,4\n2,500,20,5\n3,2000,50,8\n")
    run = run_fmu(pair, table, step=0.5)
    assert run.t.tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert run.values["z"].tolist() == [10, 10, 20, 30, 40]
    assert run.values["y_1"].tolist() == [8, 8, 10, 12, 14]
    assert run.values["y_2"].tolist() == [-1, -1, -2, *(-np.interp([1.0, 1.5], [0.5, 2], [2, 3])).tolist()]


@pytest.mark.turn("a foreign FMU alone")
@pytest.mark.some(1)
@pytest.mark.parametrize(("given", "want"), [
    ({}, (0.5, 2.0)),
    ({"stop": 3.0}, (0.5, 3.0)),
    ({"step": 0.25}, (0.25, 2.0)),
    ({"step": 1.0, "stop": 4.0}, (1.0, 4.0)),
])  # fmt: skip
def test_times_and_steps(pair: Path, given: dict[str, float], want: tuple[float, float]) -> None:
    run = run_fmu(pair, None, None, **given)  # type: ignore[arg-type]
    assert (run.t[1], run.t[-1]) == want


@pytest.mark.parametrize(("more", "message"), [
    ({"stop": -1.0}, "the stop time must be finite and after the start at 0 s; got -1"),
    ({"step": 0.0, "stop": 1.0}, "the step must be finite and greater than 0; got 0"),
    ({"step": 1e-12, "stop": 1.0}, "1e\\+12 steps of 1e-12 s; at least 1 and at most 10000000 can run"),
    ({"settings": {"kk": 1}}, "no parameter 'kk'; there are b, a"),
    ({}, "The FMU states no stop time. Give it with --stop"),
])  # fmt: skip
def test_a_run_that_makes_no_sense_is_refused(tmp_path: Path, more: dict[str, Any], message: str) -> None:
    graph = Graph.single(Node("lag", "transfer_function", {"na": 1, "nb": 0}, {"b": [1.0], "a": [0.1, 1.0]}))
    export_fmu(graph.with_step(1e-3), tmp_path / "lag.fmu")
    edit = re.sub(r' stopTime="[^"]*"', "", zipfile.ZipFile(tmp_path / "lag.fmu").read("modelDescription.xml").decode())
    path = exchange_only(tmp_path / "lag.fmu", tmp_path / "me.fmu", lambda _: edit)
    with pytest.raises(InputError, match=message):
        run_fmu(path, **more)


@pytest.mark.turn("a foreign FMU alone")
def test_the_command_writes_all_outputs(tmp_path: Path) -> None:

    export_fmu(Graph.single(Node("gain", "scaling", {"n": 1})).with_step(0.01), tmp_path / "gain.fmu")
    (tmp_path / "in.csv").write_text("t,u\n0,0\n1,1\n")
    out = tmp_path / "out.csv"
    command = [
        "simulate", str(tmp_path / "gain.fmu"), "--input", str(tmp_path / "in.csv"), "--set", "gain=-3", "--stop", "1",
    ]  # fmt: skip
    done = invoked([*command, "--step", "0.25", "-o", str(out)])
    assert out.read_text() == "t,y\n0.0,0.0\n0.25,0.0\n0.5,-0.75\n0.75,-1.5\n1.0,-2.25\n"
    assert "5 rows, 0 to 1 s\ny  min -2.25  max 0  end -2.25" in done.output
    done = invoked([*command, "--coupling", "jacobi"], status=2)
    assert "gain.fmu: --coupling is an option of .ssp files." in done.output
