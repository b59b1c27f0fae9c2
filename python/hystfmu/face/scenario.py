"""The class of scenarios. A scenario is read from a scenario.toml or built in Python."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import BaseModel

from hystfmu.base import InputError, check, checked
from hystfmu.face.table import What, completed, described, files, save
from hystfmu.model import Model
from hystfmu.scenario import Cases, Engine, Result, run
from hystfmu.scenario.system.case import check_name, split_end
from hystfmu.scenario.system.spec import (
    CaseSpec,
    MarginsSpec,
    MetricKind,
    MetricSpec,
    ScenarioSpec,
    Scheme,
    UnitSpec,
    inside,
)

if TYPE_CHECKING:
    from hystfmu.scenario.loop.opened import OpenedLoop

__all__ = ["Scenario"]


@checked
class Scenario:
    """A closed loop of units with connections, metrics and cases.

    In each step, the units run in the order in which they were added, unless `order` sets another order. The inputs of
    a unit are the newest outputs of the other units. Usually the plant runs first, with the command from the previous
    step. Then the other units run with the new output of the plant.

    Parameters
    ----------
    name : str
        Name of the scenario: a letter, followed by letters, digits or _.
    step : float
        Time step of the units (s).
    stop : float, optional
        End of the simulation (s). The default is three periods of the slowest reference; the metrics then ignore the
        first period.
    ripple : int
        Number of steps of a `fine` unit in each step of the scenario.
    text : str
        Description in one line.
    coupling : {"gauss_seidel", "jacobi", "iterative"}
        Coupling scheme: how the units exchange values within a step.

    Raises
    ------
    InputError
        The name is invalid, or the step is not greater than 0.

    Notes
    -----
    Each method that changes a scenario returns the changed scenario. If connections or metrics name a unit
    ``reference`` that was not added, this unit is created. Its output `r` is a sine over 80 % of the stroke of the
    plant. Its output `r_lead` is the same sine one step ahead, for an inverse.

    Examples
    --------
    >>> import hystfmu as hy
    >>> plant = hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii")
    >>> loop = hy.Scenario("tracking", step=1e-4)
    >>> loop = loop.add("plant", plant, fine=True).add("inverse", plant.inverse())
    >>> loop = loop.connect("reference.r_lead", "inverse.u").connect("inverse.y", "plant.u")
    >>> loop = loop.metric("tracking", "rms_percent", "plant.y", against="reference.r", limit=0.05)
    >>> loop
    Scenario('tracking', 2 units, 1 metric, 1 case)
    >>> loop.run().passed
    True
    >>> loop.save("mine").name
    'mine'
    """

    def __init__(
        self,
        name: str,
        *,
        step: float,
        stop: float | None = None,
        ripple: int = 1,
        text: str = "",
        coupling: Scheme = "gauss_seidel",
    ) -> None:
        self._origin = f"scenario {name!r}"
        check_name(name, self._origin)
        self._folder: Path | None = None
        self._attached: dict[str, Model | Path] = {}
        if not (isinstance(step, (int, float, np.number)) and np.isfinite(step) and step > 0):
            raise InputError(f"{self._origin}: The step must be a float in (0, inf). Got {step} instead.")
        self._spec = _stated(ScenarioSpec, name=name, step=_number(step), text=text, stop=_number(stop), ripple=ripple)
        self._spec |= {"coupling": {"scheme": coupling}} if coupling != "gauss_seidel" else {}

    @classmethod
    def load(cls, path: str | Path) -> Scenario:
        """Read a scenario from a file scenario.toml.

        Parameters
        ----------
        path : str or Path
            The file, or the folder that contains it.

        Raises
        ------
        InputError
            The file is missing or invalid. The message states the file, the key, the rule and the value.
        """
        read = Cases(path)
        made = cls(read.spec.name, step=read.spec.step)
        made._origin, made._folder = read.origin, read.folder
        made._spec = read.spec.model_dump(by_alias=True, exclude_unset=True, exclude={"format"})
        return made

    # ---- what a scenario says ---------------------------------------------------------------------------------------
    @property
    def name(self) -> str:
        """Name of the scenario."""
        return str(self._spec["name"])

    @property
    def cases(self) -> tuple[str, ...]:
        """Names of the cases. A scenario without cases has the single case ``nominal``."""
        return tuple(c["name"] for c in self._spec.get("case", ())) or ("nominal",)

    def add(
        self,
        name: str,
        what: What,
        *,
        fine: bool = False,
        every: int = 1,
        substeps: int = 1,
        hold: Literal["zero", "first"] = "zero",
        runs_as: Literal["fmu2", "fmu3"] = "fmu2",
        inputs: Mapping[str, float] | None = None,
        set: Mapping[str, Any] | None = None,
        text: str = "",
    ) -> Scenario:
        """Add a unit to the loop.

        Parameters
        ----------
        name : str
            Name of the unit. Its ports are ``name.port``.
        what : Model, block, Node, Graph, or path
            The unit. A path names an FMU of any origin or a ``*.model.toml``.
        fine : bool
            Whether the unit makes `ripple` steps in each step of the scenario. Use this for plants, and for signals
            that are evaluated between samples.
        every : int
            Number n. The unit runs only in every n-th step.
        substeps : int
            Number of internal steps in each run of the unit.
        hold : {"zero", "first"}
            Extrapolation of connected inputs between two runs of the unit: constant ("zero"), or linear through the
            last two values ("first").
        runs_as : {"fmu2", "fmu3"}
            FMI version of the FMU of this unit, which the engine "fmpy" simulates.
        inputs : mapping of str to float, optional
            Constant values of unconnected inputs.
        set : mapping, optional
            New values of parameters by name. A string such as ``"*1.2"`` multiplies the old value.
        text : str
            Description in one line.

        Raises
        ------
        InputError
            A unit with this name exists, or `what` cannot be a unit.
        """
        where = f"{self._origin}: units.{name}"
        check_name(name, where)
        if name in self._spec.get("units", {}):
            raise InputError(f"{where}: The name of a unit must occur once. Got a second {name!r}.")
        table, attached = described(what, name, where)
        said = {"fine": fine, "every": every, "substeps": substeps, "hold": hold, "as": runs_as, "text": text}
        table |= _stated(UnitSpec, **said, inputs=_number(inputs)) | ({"set": dict(set)} if set else {})
        check(table, UnitSpec, where)
        self._edit()
        self._spec.setdefault("units", {})[name] = table
        if "order" in self._spec:
            self._spec["order"].append(name)
        self._attached |= attached
        return self

    def connect(self, source: str, target: str) -> Scenario:
        """Connect the output `source` to the input `target`. Both have the form ``unit.port``.

        Raises
        ------
        InputError
            An end is not of the form ``unit.port``, or the input is already connected.
        """
        for end in (source, target):
            split_end(end, f"{self._origin}: connections")
        known = self._spec.get("connections", {}).get(target)
        if known is not None:
            raise InputError(
                f"{self._origin}: connections: The input {target!r} must have one source. Got {source!r} and {known!r}."
            )
        self._edit()
        self._spec.setdefault("connections", {})[target] = source
        return self

    def metric(
        self,
        name: str,
        kind: MetricKind,
        signal: str,
        against: str | None = None,
        limit: float | None = None,
        *,
        stroke: float | None = None,
        after: float | None = None,
        lines: bool = False,
        text: str = "",
    ) -> Scenario:
        """Add a metric, with or without a limit.

        Parameters
        ----------
        name : str
            Name of the metric.
        kind : str
            Kind of metric. The error e is `signal` - `against`.

            - ``rms_percent``, ``rms``: RMS value of e, also between samples, in percent of the stroke or in the unit of
              measure of `signal`
            - ``max_percent``: largest abs(e), also between samples
            - ``between_samples_percent``: ripple, that is, largest deviation of e from the line between two samples
              in the window
            - ``variation_ratio``: total variation of `signal` divided by that of `against`, at samples
            - ``peak``: largest abs(`signal`)
            - ``final``: abs(e) at the end, or abs(`signal`) without `against`
            - ``loop_area_percent``: area of the loop of `signal` over `against`, in percent of the rectangle of their
              spans; the window must be one period
        signal, against : str
            Signals ``unit.output``. Only ``peak`` and ``final`` do not need `against`.
        limit : float, optional
            Largest allowed value, in the unit of the metric.
        stroke : float, optional
            Value that corresponds to 100 percent. The default is the span of `against`.
        after : float, optional
            Only rows at or after this time (s) are used.
        lines : bool
            Whether to evaluate only the scan lines of a scanning reference, without the turns between them. It applies
            to rms_percent, rms and max_percent. The reference needs a new value in every row (``fine=True``).
        text : str
            Description in one line.
        """
        numbers = {k: _number(v) for k, v in (("limit", limit), ("stroke", stroke), ("after", after))}
        said = {"kind": kind, "signal": signal, "against": against, **numbers, "lines": lines, "text": text}
        self._edit()
        self._spec.setdefault("metrics", {})[name] = _stated(MetricSpec, **said)
        return self

    def case(
        self,
        name: str,
        text: str = "",
        *,
        stop: float | None = None,
        after: float | None = None,
        set: Mapping[str, Any] | None = None,
        limits: Mapping[str, float] | None = None,
        units: Mapping[str, What] | None = None,
        order: Sequence[str] | None = None,
        connections: Mapping[str, str] | None = None,
    ) -> Scenario:
        """Add a case: a variation of the scenario.

        Parameters
        ----------
        name : str
            Name of the case.
        text : str
            Description in one line.
        stop, after : float, optional
            End of the simulation (s), and time (s) from which on metrics are evaluated.
        set : mapping, optional
            New parameter values, ``{"unit.parameter": value}``. A string such as ``"*1.2"`` multiplies the old value.
        limits : mapping, optional
            Limits of the metrics, by name of the metric.
        units : mapping, optional
            Units to add or to replace. The new unit adopts settings such as `fine` and `every` from the replaced unit.
        order : sequence of str, optional
            Order of the units. The default is the order in the scenario.
        connections : mapping, optional
            Connections to add or to replace, ``{"unit.input": "unit.output"}``.
        """
        table = _stated(CaseSpec, name=name, text=text, stop=_number(stop), after=_number(after))
        table |= _stated(CaseSpec, limits=_number(limits))
        table |= {k: dict(v) for k, v in (("set", set), ("connections", connections)) if v}
        table |= {"order": list(order)} if order is not None else {}
        self._edit()
        for unit, what in (units or {}).items():
            made, attached = described(what, f"{name}_{unit}", f"{self._origin}: case {name}: units.{unit}")
            kept = ("fine", "every", "substeps", "hold", "as", "inputs")
            old = {k: v for k, v in self._spec.get("units", {}).get(unit, {}).items() if k in kept}
            table.setdefault("units", {})[unit] = old | made
            self._attached |= attached
        self._spec.setdefault("case", []).append(table)
        return self

    def order(self, *names: str) -> Scenario:
        """Set the order in which the units run. `names` must contain each unit once."""
        self._edit()
        self._spec["order"] = list(names)
        return self

    def record(self, *signals: str) -> Scenario:
        """Set the signals in the baseline and in the report. The default is the signals of the metrics."""
        self._edit()
        self._spec["record"] = list(signals)
        return self

    def loop(self, abscissa: str, ordinate: str) -> Scenario:
        """Add a plot to the report, with the output `ordinate` over the output `abscissa`."""
        self._edit()
        self._spec.setdefault("loops", []).append([abscissa, ordinate])
        return self

    def margins(
        self,
        case: str | None = None,
        *,
        Ms_db: float | None = None,
        corners: Sequence[str] = ("*",),
        slopes: tuple[float, float] | None = None,
        stable_to_steps: float | None = None,
        expected_unstable: Sequence[str] = (),
    ) -> Scenario:
        """Set limits for the margins of the linearised loop. ``hystfmu margins`` checks these limits.

        Parameters
        ----------
        case : str, optional
            Case whose sensitivity is limited. The sensitivity is computed for the incremental gain 1 of inverse and
            plant in series. The default is the first case.
        Ms_db : float, optional
            Largest allowed peak of the sensitivity (dB).
        corners : sequence of str
            Cases whose loops must be stable; the wildcards ``?`` and ``*`` are allowed.
        slopes : (float, float), optional
            Smallest and largest incremental gain of inverse and plant in series, for which the loops of the corners
            must be stable. The default is the range of the incremental gain during each case.
        stable_to_steps : float, optional
            Additional delay in steps up to which the loop of each corner must be stable.
        expected_unstable : sequence of str
            Cases whose linearised loop is unstable for an incremental gain that occurs during the case, although the
            simulation meets the limits. The loops of all other cases must be stable.
        """
        numbers = {"Ms_db": Ms_db, "stable_to_steps": stable_to_steps, "slopes": slopes}
        said = {"case": case} | {k: _number(v) for k, v in numbers.items()}
        self._edit()
        self._spec["margins"] = _stated(MarginsSpec, **said, expected_unstable=list(expected_unstable))
        self._spec["margins"]["corners"] = list(corners)
        return self

    # ---- what is done with it ---------------------------------------------------------------------------------------
    def run(
        self,
        case: str | None = None,
        *,
        engine: Engine = "fmpy",
        set: Mapping[str, Any] | None = None,
        coupling: Scheme | None = None,
        seconds: float = 600.0,
        confined: bool = True,
        out: str | Path | None = None,
    ) -> Result:
        """Simulate one case. `hystfmu.run(scenario)` simulates all cases.

        Parameters
        ----------
        case : str, optional
            Name of the case. It is required if the scenario has several cases.
        engine, set, coupling, seconds, confined, out
            See `hystfmu.run`.

        Returns
        -------
        Result
            Result of the simulation, compared with the limits. If the scenario was read from a file and not changed,
            the result is also compared with the baseline.

        Raises
        ------
        InputError
            A key, a unit or a connection is invalid. The message states its name.
        """
        if case is None and len(self.cases) > 1:
            raise InputError(
                f"{self._origin}: The case of run() must be one of {', '.join(self.cases)}. Got none; hystfmu.run() "
                "runs all."
            )
        return run(
            self, case=case, engine=engine, set=set, coupling=coupling, seconds=seconds, confined=confined, out=out
        )[0]

    def save(self, folder: str | Path) -> Path:
        """Write the file scenario.toml and the models and FMUs of all units into a folder.

        ``hystfmu run folder`` simulates this scenario with bit-identical results. Its option ``--record`` writes the
        first baseline into `folder`.

        Returns
        -------
        Path
            The folder.

        Raises
        ------
        InputError
            The scenario is incomplete, or a file cannot be written.
        """
        whole = copy.deepcopy(self)
        whole._edit()
        spec = completed(whole._spec, whole._attached, whole._origin)
        whole.ready()  # what is written can be read
        return save(spec, whole._attached, Path(folder))

    def export_controller(
        self,
        path: str | Path,
        fmi: Literal[2, 3] = 2,
        case: str | None = None,
        name: str | None = None,
        platforms: Literal["host", "all"] = "host",
        source: bool = False,
    ) -> Path:
        """Write the controller as an FMU: all units from reference and measured output to the command.

        The inputs are the reference `r`, the measured output `y`, future values or derivatives of the reference for the
        feed-forward (`r_ahead`, `r_dot`, `r_ddot`), and the command before the start, `u_present`. The output is the
        command `u`. The FMU must be called once per sample.

        Parameters
        ----------
        path : str or Path
            File to write, with the ending ``.fmu``. If an error occurs, no incomplete file remains.
        case : str, optional
            Case whose parameter values the controller uses. The default is the first case.
        fmi, name, platforms, source
            See `Model.export`; the default name is the name of the scenario.

        Raises
        ------
        InputError
            The case does not exist, or the loop has no controller with one command and one measured output. The units
            of the controller have different steps, or a unit is a foreign FMU. The file cannot be written.

        Examples
        --------
        >>> import hystfmu as hy
        >>> plant = hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii")
        >>> loop = hy.Scenario("tracking", step=1e-3).add("plant", plant).add("inverse", plant.inverse())
        >>> loop = loop.connect("reference.r", "inverse.u").connect("inverse.y", "plant.u")
        >>> loop = loop.metric("tracking", "rms_percent", "plant.y", against="reference.r")
        >>> loop.export_controller("controller.fmu").name
        'controller.fmu'
        """
        from hystfmu.fmu.write.export import export_fmu
        from hystfmu.scenario.deploy import controller

        made = controller(self.ready().named(case))
        return export_fmu(made.model, path, fmi, name, platforms, source)

    def open_loop(self, case: str | None = None, *, set: Mapping[str, Any] | None = None) -> OpenedLoop:
        """Return the linearised loop of a case, opened at the input of its plant.

        Parameters
        ----------
        case : str, optional
            Name of the case. The default is the first case.
        set : mapping, optional
            New parameter values, ``{"unit.parameter": value}``. A string such as ``"*1.2"`` multiplies the old value.

        Raises
        ------
        InputError
            The case is unknown, or its loop cannot be linearised at the rest point.

        Examples
        --------
        >>> import hystfmu as hy
        >>> hy.Scenario.load("scenarios/pid").open_loop("sine_10").margins().stable  # doctest: +SKIP
        True
        """
        from hystfmu.scenario import build
        from hystfmu.scenario.loop.opening import open_loop

        cases = {c.name: c for c in self.ready().changed(dict(set or {}), None).cases}
        if case is not None and case not in cases:
            raise InputError(f"{self._origin}: The case must be one of {', '.join(cases)}. Got {case!r} instead.")
        return open_loop(build(cases[case] if case is not None else next(iter(cases.values()))), (1.0, 1.0))

    @property
    def table(self) -> dict[str, Any]:
        """Return a copy of the complete content of the scenario, with the keys of a scenario.toml."""
        return copy.deepcopy(completed(self._spec, self._attached, self._origin))

    def changed(self, table: Mapping[str, Any]) -> Scenario:
        """Return a scenario with the content `table` and with the models and FMUs of this scenario.

        Parameters
        ----------
        table : mapping
            Changed copy of the dict that the method `table` returns.

        Raises
        ------
        InputError
            A key is invalid.
        """
        made = copy.copy(self)
        made._edit()
        made._attached = dict(made._attached)
        check(dict(table), ScenarioSpec, made._origin)
        made._spec = copy.deepcopy(dict(table))
        return made

    def ready(self) -> Cases:
        """Return the complete cases that `hystfmu.scenario` can simulate.

        Raises
        ------
        InputError
            See `run`.
        """
        spec = completed(self._spec, self._attached, self._origin)
        return Cases.of(check(spec, ScenarioSpec, self._origin), self._origin, self._attached, self._folder)

    def _repr_html_(self) -> str:
        """Return HTML for a notebook: units in their order, connections, metrics, cases."""
        from hystfmu.face.table import scenario_html

        return scenario_html(self._spec)

    def __repr__(self) -> str:
        counts = [(len(self._spec.get(key, ())), word) for key, word in (("units", "unit"), ("metrics", "metric"))]
        shown = [f"{n} {word}{'' if n == 1 else 's'}" for n, word in [*counts, (len(self.cases), "case")]]
        return f"Scenario({', '.join([repr(self.name), *shown])})"

    def _edit(self) -> None:
        """Separate the scenario from its file before a change: remove the baseline, store the paths of files."""
        if self._folder is None:
            return
        self._attached = dict(self._attached)
        for unit, key in files(self._spec):
            self._attached.setdefault(unit[key], inside(self._folder, unit[key], f"{self._origin}: {key}"))
        self._folder, self._origin = None, f"scenario {self.name!r}"


def _stated(form: type[BaseModel], **values: Any) -> dict[str, Any]:
    """Return the table of a scenario.toml with the values that differ from the defaults of `form`, and all floats."""
    usual = {f.alias or name: f.get_default(call_default_factory=True) for name, f in form.model_fields.items()}
    # a float equal to its default stays: a metric that states after=0.0 does not ignore the first period
    return {k: v for k, v in values.items() if v is not None and (isinstance(v, float) or v != usual[k])}


def _number(value: Any) -> Any:
    """Convert numbers to floats. Other values stay unchanged, and the check of the content reports them."""
    if isinstance(value, Mapping):
        return {k: _number(v) for k, v in value.items()}
    if isinstance(value, tuple):
        return [_number(v) for v in value]
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        return value
    return float(value)
