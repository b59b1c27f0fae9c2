"""Archives of a system written by hand: every element that is read, and the sentence for each that is not."""

import re
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from drawn_unit import Variable, drawn_fmu
from engines import ready

from hystfmu import Graph, Input, InputError, Node, Output
from hystfmu.fmu import export_fmu
from hystfmu.scenario.ssp.container import joined
from hystfmu.scenario.ssp.measures import SSC
from hystfmu.scenario.ssp.read import OSP, OURS, REFERENCE, SSD, Ssp, read_ssp, run_ssp
from hystfmu.scenario.ssp.write import SSV, write_ssp
from hystfmu.scenario.system.system import build


def component(name: str, inside: str = "", u: str = "", y: str = "", **more: str) -> str:
    """A component whose connectors u and y have these units of measure."""
    facts = {"name": name, "source": f"resources/{name}.fmu"} | more
    ends = "".join(
        f'<d:Connector name="{n}" kind="{k}">{f"<c:Real unit={unit!r}/>" if unit else ""}</d:Connector>'
        for n, k, unit in (("u", "input", u), ("y", "output", y), ("w", "input", ""))
    )
    told = " ".join(f'{k}="{v}"' for k, v in facts.items())
    return f"<d:Component {told}><d:Connectors>{ends}</d:Connectors>{inside}</d:Component>"


def wire(start: str, end: str, inside: str = "", more: str = "") -> str:
    (a, b), (c, d) = start.split("."), end.split(".")
    ends = f'startElement="{a}" startConnector="{b}" endElement="{c}" endConnector="{d}" {more}'
    return f"<d:Connection {ends}>{inside}</d:Connection>"


def values(*parameters: str, prefix: str = "") -> str:
    listed = "".join(parameters)
    return (
        f'<d:ParameterBindings><d:ParameterBinding prefix="{prefix}"><d:ParameterValues><v:ParameterSet>'
        f"<v:Parameters>{listed}</v:Parameters></v:ParameterSet></d:ParameterValues></d:ParameterBinding>"
        "</d:ParameterBindings>"
    )


def bound(facts: str) -> str:
    return f"<d:ParameterBindings><d:ParameterBinding {facts}/></d:ParameterBindings>"


def value(name: str, text: str, word: str = "Real") -> str:
    return f'<v:Parameter name="{name}"><v:{word} value="{text}"/></v:Parameter>'


LONG = 300 * "x"  # no file of a system has this name
EXPERIMENT = '<d:DefaultExperiment stopTime="1.0"/>'
TWO = component("a") + component("b")
BOTH = wire("a.y", "b.u") + wire("b.y", "a.u")


def note(**facts: str) -> str:
    told = " ".join(f'{k}="{v}"' for k, v in facts.items())
    return (
        f'<d:DefaultExperiment stopTime="1.0"><d:Annotations><h:Coupling {told}/></d:Annotations></d:DefaultExperiment>'
    )


def archive(
    folder: Path, elements: str = TWO, wires: str = BOTH, rest: str = EXPERIMENT, shared: str = "", files: Any = None
) -> Path:
    spaces = f'xmlns:c="{SSC}" xmlns:d="{SSD}" xmlns:v="{SSV}" xmlns:h="{OURS}" xmlns:o="{OSP}"'
    system = f"<d:System>{shared}<d:Elements>{elements}</d:Elements><d:Connections>{wires}</d:Connections></d:System>"
    text = f"<d:SystemStructureDescription {spaces}>{system}{rest}</d:SystemStructureDescription>"
    path = folder / "s.ssp"
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("SystemStructure.ssd", text)
        for name, content in {"resources/a.fmu": "", "resources/b.fmu": "", **(files or {})}.items():
            z.writestr(name, content)
    return path


def read(folder: Path, step: float | None = 0.25, stop: float | None = None, **more: Any) -> Ssp:
    return read_ssp(archive(folder, **more), step, stop)


def two(folder: Path) -> dict[str, bytes]:
    """Both FMUs with inputs u, w and c, of which c is no connector, an output y, and parameters."""
    ends = [Variable(name, "Real", "input", (0.0,)) for name in ("u", "w", "c")]
    ends += [Variable(name, "Real", "parameter", (0.0,)) for name in ("own", "z.q", *"pnmkfestoxl")]
    chosen = [Variable("mode", "Enumeration", "parameter", (1,)), Variable("way", "Enumeration", "input", (1,))]
    drawn_fmu(folder / "x.fmu", 2, [*ends, *chosen, Variable("y", "Real", "output", (0.0,))])
    content = (folder / "x.fmu").read_bytes()
    return {"resources/a.fmu": content, "resources/b.fmu": content}


# ---- what is read --------------------------------------------------------------------------------------------------


def test_a_connection_has_no_direction(tmp_path: Path) -> None:
    assert read(tmp_path, wires=wire("b.u", "a.y") + wire("b.y", "a.u")).case.connections == {
        "b.u": "a.y",
        "a.u": "b.y",
    }
    through = wire("a.u", "b.w")  # of two inputs, or two outputs, the end is driven
    assert read(tmp_path, wires=through).case.connections == {"b.w": "a.u"}
    assert read(tmp_path, wires=wire("a.y", "b.y")).case.connections == {"b.y": "a.y"}
    outside = '<d:Connection endElement="a" endConnector="u" startConnector="x"/>'
    assert read(tmp_path, wires=outside).case.connections == {}


def test_variables_with_structured_names(tmp_path: Path) -> None:
    ends = [Variable("arm.q[1]", "Real", "input", (0.0,)), Variable("arm.y", "Real", "output", (0.0,))]
    drawn_fmu(tmp_path / "x.fmu", 2, [*ends, Variable("arm.k", "Real", "parameter", (1.0,))])
    listed = '<d:Connector name="arm.q[1]" kind="input"/><d:Connector name="arm.y" kind="output"/>'
    unit = '<d:Component name="{0}" source="resources/{0}.fmu"><d:Connectors>{1}</d:Connectors></d:Component>'
    between = 'startElement="a" startConnector="arm.y" endElement="b" endConnector="arm.q[1]"'
    files = dict.fromkeys(("resources/a.fmu", "resources/b.fmu"), (tmp_path / "x.fmu").read_bytes())
    elements, wires = unit.format("a", listed) + unit.format("b", listed), f"<d:Connection {between}/>"
    case = read(tmp_path, elements=elements, wires=wires, files=files).case
    system = build(replace(case, overrides={"b.arm.k": 2.0}))
    assert case.connections == {"b.arm.q[1]": "a.arm.y"}
    assert (list(system.columns), set(system.overridden)) == (["a.arm.y", "b.arm.y"], {"b.arm.k"})


def test_what_has_no_effect_on_a_run(tmp_path: Path) -> None:
    notes = '<d:Annotations><c:Annotation type="x"><h:x/></c:Annotation></d:Annotations>'
    drawing = '<d:ConnectionGeometry pointsX="0.5 1" pointsY="0 1"/>'
    given = value("p", "1").replace("</v:P", f"{notes.replace('d:', 'v:')}</v:P")
    elements, wires = component("a", values(given)) + component("b"), wire("a.y", "b.u", drawing + notes)
    case = read(tmp_path, elements=elements, wires=wires, files=two(tmp_path)).case
    assert (case.connections, case.units["a"].set) == ({"b.u": "a.y"}, {"p": 1.0})
    elements = elements.replace("<d:ParameterBinding ", '<d:ParameterBinding source="" ')
    assert read(tmp_path, elements=elements, files=two(tmp_path)).case.units["a"].set == {"p": 1.0}


def test_steps_and_times(tmp_path: Path) -> None:
    told = note(step="0.5", scheme="gauss_seidel", order="b a")
    assert read(tmp_path, None, rest=told).case.step == 0.5
    assert read(tmp_path, 0.125, rest=told).case.step == 0.125
    assert (read(tmp_path, None, rest=told).case.order, read(tmp_path, rest=told).case.coupling.scheme) == (
        ("b", "a"), "gauss_seidel",
    )  # fmt: skip
    fixed = '<d:DefaultExperiment stopTime="1.0"><o:FixedStepAlgorithm baseStepSize="0.2"/></d:DefaultExperiment>'
    assert read(tmp_path, None, rest=fixed).case.step == 0.2
    assert read(tmp_path, 0.25, 2.1).case.stop == 2.0
    assert read(tmp_path, 0.25, 0.25).case.stop == 0.25


def test_values_of_every_kind(tmp_path: Path) -> None:
    listed = [
        value("p", "1.5"), value("n", "3", "Integer"), value("m", "4", "UInt8"), value("k", "5", "Int64"),
        value("f", "0.5", "Float32"), value("e", "2", "Enumeration"), value("s", "text", "String"),
        value("t", "true", "Boolean"), value("o", "1", "Boolean"), value("x", "0", "Boolean"),
        value("w", "7.5"), value("u", "9"), value("c", "true", "Boolean"), value("l", "9007199254740993", "Int64"),
        value("mode", "e3", "Enumeration"), value("way", "e2", "Enumeration"),
    ]  # fmt: skip
    elements = component("a", values(*listed)) + component("b", values(value("q", "2"), prefix="z."))
    shared = values(value("a.p", "9"), value("a.own", "6"), value("b.w", "8"))
    units = read(tmp_path, elements=elements, shared=shared, files=two(tmp_path)).case.units
    assert units["a"].set == {
        "own": 6.0, "p": 9.0, "n": 3.0, "m": 4.0, "k": 5.0, "f": 0.5, "e": 2.0, "s": "text", "t": True, "o": True,
        "x": False, "l": 2**53 + 1, "mode": 3,
    }  # fmt: skip
    assert units["a"].inputs == {"w": 7.5, "c": 1.0, "way": 2.0}, "u is driven: its start value is of no use"
    assert (units["b"].set, units["b"].inputs) == ({"z.q": 2.0}, {"w": 8.0})
    for given, said in (
        (value("w", "text", "String"), "a: w: an input must be a number. Got 'text' instead."),
        (value("mode", "e4", "Enumeration"), "a: mode: must be one of e1, e2, e3; got 'e4'"),
    ):
        with pytest.raises(InputError, match=re.escape(said)):
            read(tmp_path, elements=component("a", values(given)) + component("b"), files=two(tmp_path))


def test_a_parameter_without_a_variable_is_named(tmp_path: Path) -> None:
    """The schema of ParameterBinding: such a parameter is ignored."""
    elements = component("a", values(value("p", "2"), value("gian", "3"))) + component("b")
    shared = values(value("a.q", "4"), value("plant.p", "5"), value("p", "6"))
    found = read(tmp_path, elements=elements, shared=shared, files=two(tmp_path))
    assert found.case.units["a"].set == {"p": 2.0}
    assert found.ignored == ("a.gian", "a.q", "plant.p", "p")


def test_the_result_that_travels_with_an_archive(tmp_path: Path) -> None:
    found = read(tmp_path, files={REFERENCE: "t,a.y\n0,1\n0.5,2\n"})
    assert found.signals == ("a.y",)
    assert found.reference is not None
    assert found.reference.tolist() == [[0.0, 1.0], [0.5, 2.0]]
    for text in ("x,a.y\n0,1\n", "t,a.y\n0\n", "t,a.y\n0,x\n", "", "t,a.y\n0,1\n0,1,2\n"):
        with pytest.raises(
            InputError,
            match=re.escape(f"{REFERENCE}: must have a header t,... and rows with the same number of values"),
        ):
            read(tmp_path, files={REFERENCE: text})


# ---- what is not ---------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("change", "said"), [
    ({"step": None}, "states no step: give it with --step SECONDS"),
    ({"rest": ""}, "states no stop time: give it with --stop SECONDS"),
    ({"rest": '<d:DefaultExperiment stopTime="x"/>'}, "stopTime: must be a number; got 'x'"),
    ({"rest": '<d:DefaultExperiment stopTime="inf"/>'}, "stopTime: must be a number; got 'inf'"),
    ({"step": None, "rest": note(order="a b")}, "step: must be a number; got None"),
    ({"step": 2.0}, "the step must be greater than 0 and not above the stop time; got 2, 1"),
    ({"step": 0.0}, "the step must be greater than 0 and not above the stop time; got 0, 1"),
    ({"rest": note(order="a")}, "order: must name every component once; got a"),
    ({"rest": note(order="a b", scheme="x")}, "scheme: must be gauss_seidel, jacobi or iterative; got 'x'"),
    ({"elements": "", "wires": ""}, "has no components"),
    ({"elements": '<d:System name="n"/>'}, "n: System is not supported: components must not be nested"),
    ({"elements": component("a") * 2}, "a component must have a unique name of letters, digits and _; got 'a'"),
    ({"elements": component("1a")}, "a component must have a unique name of letters, digits and _; got '1a'"),
    ({"elements": component("a", type="application/x-ssp")}, "a: must be an FMU; got the type 'application/x-ssp'"),
    ({"elements": component("a", values(value("p", "1", "Binary")))},
     "ParameterValues: p: a value of type Binary is not read"),
    ({"elements": component("a", values(value("p", "yes", "Boolean")))},
     "ParameterValues: p: must be true or false; got 'yes'"),
    ({"elements": component("a", values(value("p", "z")))}, "ParameterValues: p: must be a number; got 'z'"),
    ({"wires": wire("a.y", "c.u")}, "a connection names c.u, which does not exist"),
    ({"wires": wire("a.z", "b.u")}, "a connection names a.z, which does not exist"),
    ({"wires": wire("a.y", "b.u", "<d:LinearTransformation/>")},
     "connection of a.y: transformations are not supported"),
    (
        {
            "shared": "<d:ParameterBindings><d:ParameterBinding><d:ParameterMapping/></d:ParameterBinding>"
            "</d:ParameterBindings>"
        },
        "parameter mappings (SSM) are not supported",
    ),
    ({"wires": BOTH + wire("b.y", "b.u")}, "b.u is connected twice, with a.y and with b.y"),
    ({"elements": component("a", source="../s.ssp")}, "a: source: must be a file of the archive; got '../s.ssp'"),
    ({"elements": component("a", source="a%20b")}, "a: source: must be a file of the archive; got 'a%20b'"),
    ({"elements": component("a", source=LONG)}, f"a: source: must be a file of the archive; got '{LONG}'"),
    ({"shared": bound('source="%00"')}, "%00: embedded null byte"),
    ({"elements": component("a", implementation="ScheduledExecution")}, "a: Scheduled Execution is not supported"),
    ({"shared": bound('type="text/csv" source="a.csv"')},
     "a parameter binding must have the type application/x-ssp-parameter-set; got 'text/csv'"),
    ({"shared": bound('source="a.ssv" sourceBase="component"')}, "a.ssv: sourceBase must be SSD; got 'component'"),
    ({"shared": bound('source="a.ssv"'), "files": {"a.ssv": "<ParameterSet/>"}},
     "a.ssv: must begin with ParameterSet; got ParameterSet"),
    (
        {
            "shared": '<d:Connectors><d:Connector name="k" kind="parameter"/></d:Connectors>'
            + values(value("k", "1"))
        },
        "k: a connector of the system cannot have a value: give it to a component",
    ),
    ({"wires": '<d:Connection startConnector="o" endConnector="i"/>'},
     "connection of o with i: two connectors of the system must not be connected"),
    ({"stop": 1e300}, "4e+300 steps of 0.25 s; at most 100000000 can run"),
    ({"rest": '<d:DefaultExperiment startTime="0.5" stopTime="1.0"/>'}, "startTime: must be 0; got 0.5"),
    ({"shared": '<d:ParameterBindings><d:ParameterBinding source="../../x"/></d:ParameterBindings>'},
     "'../../x' lies outside the archive"),
])  # fmt: skip
def test_what_is_not_understood_is_refused_by_name(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as e:
        read(tmp_path, **change)
    assert str(e.value) == f"{tmp_path / 's.ssp'}: SystemStructure.ssd: {said}"


def test_an_interface_that_would_not_run_is_refused(tmp_path: Path) -> None:
    elements = component("a", implementation="ModelExchange") + component("b")
    with pytest.raises(
        InputError, match="a: implementation: an FMU with Co-Simulation runs as such; got ModelExchange"
    ):
        read(tmp_path, elements=elements, files=two(tmp_path))


def test_an_fmu_of_one_instance_is_one_component(tmp_path: Path) -> None:
    files = two(tmp_path)
    with zipfile.ZipFile(tmp_path / "x.fmu") as old, zipfile.ZipFile(tmp_path / "once.fmu", "w") as new:
        for name in old.namelist():
            once = b'<CoSimulation canBeInstantiatedOnlyOncePerProcess="true"'
            new.writestr(name, old.read(name).replace(b"<CoSimulation", once))
    files["resources/b.fmu"] = (tmp_path / "once.fmu").read_bytes()
    build(read(tmp_path, files=files).case)
    files["resources/a.fmu"] = files["resources/b.fmu"]
    with pytest.raises(InputError, match=r"units\.b: the FMU can be instantiated only once per process, and a is an"):
        build(read(tmp_path, files=files).case)


def test_entities(tmp_path: Path) -> None:
    path = archive(tmp_path)
    with zipfile.ZipFile(path) as z:
        text = z.read("SystemStructure.ssd").decode()
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("SystemStructure.ssd", f'<!DOCTYPE d [<!ENTITY e "1">]>{text}')
    with pytest.raises(InputError, match=r"SystemStructure\.ssd must not declare a document type or entities"):
        read_ssp(path, 0.1)


@pytest.mark.parametrize(("one", "other", "more", "good"), [
    ("V", "mV", "", False), ("V", "m", "", False), ("V", "what", "", False), ("K", "degC", "", False),
    ("V", "mV", 'suppressUnitConversion="true"', True), ("V", "J/C", "", True), ("V", "1", "", True),
    ("V", "", "", True),
])  # fmt: skip
def test_a_connection_that_converts_units_of_measure(
    tmp_path: Path, one: str, other: str, more: str, good: bool
) -> None:
    """A reader of SSP converts 1 V to 1000 mV; who does not must not hand on the number."""
    volt = 'kg="1" m="2" s="-3" A="-1"'
    bases = {"V": volt, "J/C": volt, "mV": f'{volt} factor="0.001"', "m": 'm="1"', "1": ""}
    bases |= {"K": 'K="1"', "degC": 'K="1" offset="273.15"'}
    listed = "".join(f'<c:Unit name="{n}"><c:BaseUnit {b}/></c:Unit>' for n, b in bases.items())
    rest = f"<d:Units>{listed}</d:Units>{EXPERIMENT}"
    elements = component("a", y=one) + component("b", u=other)
    told = {"elements": elements, "wires": wire("a.y", "b.u", more=more), "rest": rest}
    if good:
        assert read(tmp_path, **told).case.connections == {"b.u": "a.y"}
        return
    with pytest.raises(InputError, match=re.escape(f"connection of a.y ({one}) with b.u ({other}): units of measure")):
        read(tmp_path, **told)


@pytest.mark.parametrize("own", [b'unit="mm"', b'declaredType="L"'])
@pytest.mark.parametrize(("unit", "good"), [("um", False), ("mm", True), ("1", True), ("", True)])
def test_a_value_in_a_unit_of_measure_of_its_own(tmp_path: Path, unit: str, good: bool, own: bytes) -> None:
    graph = Graph.single(Node("gain", "scaling", {}, {"gain": 2.0})).with_step(1e-3)
    with (
        zipfile.ZipFile(export_fmu(graph, tmp_path / "a.fmu")) as old,
        zipfile.ZipFile(tmp_path / "mm.fmu", "w") as new,
    ):
        for name in old.namelist():  # of any origin: the gain is in mm
            content = old.read(name)
            if name == "modelDescription.xml":
                content = re.sub(rb'(name="gain".*\s*<Real )unit="1"', rb"\1" + own, content)
                assert own in content
                length = b'<SimpleType name="L"><Real unit="mm"/></SimpleType>'
                content = content.replace(b"<LogC", b"<TypeDefinitions>" + length + b"</TypeDefinitions><LogC")
            new.writestr(name, content)
    given = value("gain", "3").replace("/></v:P", f' unit="{unit}"/></v:P')
    told = {"elements": component("a", values(given)), "wires": ""}
    files = {"resources/a.fmu": (tmp_path / "mm.fmu").read_bytes()}
    if good:
        assert read(tmp_path, **told, files=files).case.units["a"].set == {"gain": 3.0}
        return
    with pytest.raises(InputError, match="a: gain is given in um and is in mm in the FMU: units of measure are not"):
        read(tmp_path, **told, files=files)


@pytest.mark.parametrize(("stated", "said"), [("", "(um) with b.u (mm)"), ("m", "(m) with b.u (mm)")])
def test_a_connector_has_the_unit_of_its_variable(tmp_path: Path, stated: str, said: str) -> None:
    """SSP 1.0: a connector without a unit of measure has that of the variable of its FMU."""
    files = {}
    for name, u, y in (("a", "V", "um"), ("b", "mm", "V")):
        graph = Graph([Node("k", "scaling")], (), [Input("u", ("k.u",), u)], [Output("y", "k.y", y)])
        files[f"resources/{name}.fmu"] = export_fmu(graph, tmp_path / "x.fmu").read_bytes()
    elements = component("a", y=stated) + component("b")
    rest = f'<d:Units><c:Unit name="m"><c:BaseUnit m="1"/></c:Unit></d:Units>{EXPERIMENT}'
    path = archive(tmp_path, elements, wire("a.y", "b.u"), rest, files=files)
    with pytest.raises(InputError, match=re.escape(f"SystemStructure.ssd: connection of a.y {said}: units of measure")):
        run_ssp(path, step=0.25)


def test_a_root_of_another_kind(tmp_path: Path) -> None:
    path = archive(tmp_path)
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("SystemStructure.ssd", "<x/>")
    with pytest.raises(InputError, match=r"SystemStructure\.ssd: must begin with SystemStructureDescription; got x"):
        read_ssp(path, 0.1)
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("SystemStructure.ssd", f'<SystemStructureDescription xmlns="{SSD}"/>')
    with pytest.raises(InputError, match=r"SystemStructure\.ssd: has no System$"):
        read_ssp(path, 0.1)


# ---- the structure -------------------------------------------------------------------------------------------------


def test_an_archive_has_no_date(loop: Any, write: Any, tmp_path: Path) -> None:
    loop["stop"], loop["metrics"]["tracking"]["after"] = 0.001, 0.0
    case = ready(write(loop)).case
    made = write_ssp(case, tmp_path / "x.ssp")
    with zipfile.ZipFile(tmp_path / "x.ssp") as archive:
        assert {i.date_time for i in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert {i.compress_type for i in archive.infolist()} == {zipfile.ZIP_DEFLATED}
        names = archive.namelist()
    assert (made.components, made.path) == (1, tmp_path / "x.ssp")
    assert names == ["SystemStructure.ssd", "resources/loop.fmu", "extra/org.hystfmu/reference.csv"]


# ---- units that are joined -----------------------------------------------------------------------------------------


def test_an_algebraic_loop_is_cut_where_a_value_is_late(loop: Any, write: Any) -> None:
    del loop["units"]["plant"]["graph"]["outputs"][1]
    loop["units"]["plant"] = {"block": "scaling", "dims": {"n": 1}}
    loop["units"]["pid"] = {"block": "sum", "dims": {"n": 2}, "values": {"k": [1.0, -0.5]}}
    loop["connections"] = {"plant.u": "pid.y", "pid.u_1": "reference.r", "pid.u_2": "plant.y"}
    loop["loops"] = []
    case, names = joined(ready(write(loop)))
    assert case.order == ("plant_to_reference", "pid")
    assert names["pid.y"] == "pid.pid_y"
    assert case.connections == {
        "plant_to_reference.plant_u": "pid.pid_y", "pid.pid_u_1": "plant_to_reference.reference_r",
        "pid.pid_u_2": "plant_to_reference.plant_y",
    }  # fmt: skip
