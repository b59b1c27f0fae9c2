"""The public class of models. It adds methods for users to the base class `hystfmu.model.Model`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

import hystfmu.model
from hystfmu.base import InputError, checked, escape, with_unit
from hystfmu.data import Dataset
from hystfmu.data.reader.arrays import Columns
from hystfmu.graph.blocks import Block
from hystfmu.report.page import table
from hystfmu.report.plot import LOOP_POINTS, Line, Plot
from hystfmu.unit import Unit

if TYPE_CHECKING:
    from torch import nn

    from hystfmu.identify.device_check import DeviceCheck

__all__ = ["Model"]

InverseMethod = Literal["auto", "exact", "implicit", "learned", "adaptive"]


@checked
class Model(hystfmu.model.Model):
    """A model: a graph of blocks with parameter values, the origin of these values, and the errors of the fit.

    `hystfmu.fit` and `Model.load` return a model. The inverse of a model is also a model.

    Parameters
    ----------
    key : str
        Kind of model, e.g. ``"zhao_tan_mlp"``.
    graph : Graph
        The blocks in the order of evaluation, with all parameter values, including those of the normalisation.
    step : float or None
        Sample period of the data of the fit (s). It is None if the model does not depend on the sample period.
    text : str
        Description in one line.
    fit : dict
        Results of the fit, e.g. ``{"rms_percent": 0.7, "parameters": 49}``.
    provenance : dict
        Origin of the model: data file, rows, options, and versions of the packages.

    Examples
    --------
    >>> import hystfmu as hy
    >>> data = hy.synthetic.piezo(reversals=60, rate=1000.0)
    >>> model = hy.fit(data, "prandtl_ishlinskii")
    >>> model
    Model('prandtl_ishlinskii', u -> y, 42 parameters, RMS 0.99 %)
    >>> inverse = model.inverse()
    >>> voltage = inverse.predict([0.0, 1.0, 2.0])
    >>> [round(float(y), 6) for y in model.predict(voltage)]
    [0.0, 1.0, 2.0]
    """

    @classmethod
    def of_block(cls, block: Block, step: float | None = None) -> Model:
        """Return a single block as a model, for example for export.

        Parameters
        ----------
        block : Block
            One of `hystfmu.blocks`, with its sizes and values.
        step : float, optional
            Sample period (s) of a sampled block in Model Exchange, and step of the default experiment of an FMU.

        Examples
        --------
        >>> import hystfmu as hy
        >>> g0 = hy.blocks.TransferFunction(b=[1.0], a=[0.1, 1.0])
        >>> hy.Model.of_block(g0).export("g0.fmu").name
        'g0.fmu'
        """
        return cls(block.type.name, block.graph, step, block.type.text)

    @classmethod
    def from_torch(cls, module: nn.Module, text: str = "", step: float | None = None) -> Model:
        """Convert a feed-forward network of PyTorch to a model with the input `u` (n_in,) and the output `y` (n_out,).

        Parameters
        ----------
        module : torch.nn.Module
            A Linear, or a Sequential (also nested) of Linear, Sigmoid, Tanh, ReLU and Identity. The weights are copied.
            Further training does not change the model.
        text : str
            Description in one line.
        step : float, optional
            Sample period (s) to store in the model. A network without memory does not need it.

        Examples
        --------
        >>> import hystfmu as hy
        >>> from torch import nn
        >>> hy.Model.from_torch(nn.Sequential(nn.Linear(2, 5), nn.Tanh(), nn.Linear(5, 1)))
        Model('torch_mlp', u[2] -> y, 21 parameters)
        """
        from hystfmu.model.from_torch import torch_graph

        graph = torch_graph(module)
        weights = sum(p.numel() for p in module.parameters())
        return cls("torch_mlp", graph, step, text or "network of the user (torch.nn)", {"parameters": weights})

    def score(
        self,
        other: ArrayLike | Dataset | Columns,
        rows: slice | tuple[int, int] | str | None = None,
        *,
        y: ArrayLike | None = None,
        h: float | None = None,
        covariates: Mapping[str, ArrayLike] | None = None,
    ) -> dict[str, float]:
        """Simulate the model from row 0 of a record, and compute the errors of the simulated output.

        Parameters
        ----------
        other : Dataset or data frame with a measured output, or array, shape (n,)
            Record, or the input of the model as an array.
        rows : slice, (first, end) or "first:end", optional
            Rows on which the errors are computed, counted from 0, without the row `end`. The default is all rows.
        y : array, shape (n,), optional
            Measured output if `other` is an array.
        h, covariates
            Time step (s) and covariates if `other` is an array, as in `predict`.

        Returns
        -------
        dict
            ``rms`` and ``max`` are the RMS error and the largest error in the unit of measure of y. ``rms_percent`` and
            ``max_percent`` are the same errors in percent of the span of y in these rows.

        Raises
        ------
        InputError
            The measured output is missing or constant.

        Examples
        --------
        >>> import hystfmu as hy
        >>> model = hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii")
        >>> other = hy.synthetic.piezo(60, 1000.0, seed=1)
        >>> model.score(other)["rms_percent"] < 2.0
        True
        """
        from hystfmu.data.columns import train_rows
        from hystfmu.data.reader.reading import dataset_of
        from hystfmu.model import errors, run_along

        self._one_to_one("score")
        if y is None and not isinstance(other, np.ndarray):
            other = dataset_of(other)
        elif y is None:
            raise InputError("The output of an array must be given, score(u, y=y). Got none.")
        else:
            u = np.asarray(other, dtype=np.float64)
            step = h if h is not None else self.step if self.step is not None else 1.0
            t = np.arange(len(u)) * np.float64(step)
            other = Dataset(t, u, y, covariates=covariates)
        where = other.path or other.name
        if not other.has_output:
            raise InputError(f"{where}: The data must have a measured output to compare with. Got none.")
        counted = train_rows(rows, len(other.t), where)
        measured = other.y[counted]
        span = float(np.ptp(measured))
        if not span > 0:
            raise InputError(
                f"{where}: The output must vary for an error in percent. Got {measured[0]:g} in every row."
            )
        return errors(run_along(self.graph, other)[counted], measured, span)

    def check(self, new: Dataset | Columns, factor: float = 2.0) -> DeviceCheck:
        """Test with a new record whether the device has drifted, that is, whether the error of its model has grown.

        Parameters
        ----------
        new : Dataset or data frame
            New record with a measured output. Only rows with an input in the range of the training rows are used.
        factor : float
            Threshold of the test: the device has drifted if the RMS error on the new record is more than `factor` times
            the error stated in the model.

        Returns
        -------
        DeviceCheck
            ``drifted`` is True if the device has drifted. ``parts`` has one entry each for offset, gain, lag and loop
            shape. An entry contains the error that remains if only this property of the model is corrected.

        Raises
        ------
        InputError
            The measured output is missing, too few rows lie in the range of the training rows, or the model states no
            error.

        Examples
        --------
        >>> import hystfmu as hy
        >>> model = hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii")
        >>> new = hy.synthetic.piezo(60, 1000.0, seed=1)
        >>> model.check(new).drifted
        False
        >>> model.check(new.with_output(1.1 * new.y)).moved
        'gain'
        """
        from hystfmu.data.reader.reading import dataset_of
        from hystfmu.identify.device_check import check_device

        self._one_to_one("check")
        return check_device(self, dataset_of(new), factor)

    def plot(self, other: Dataset | Columns) -> Plot:
        """Plot the measured output and the output of the model over the input of a record.

        Parameters
        ----------
        other : Dataset or data frame
            Record. If it has no measured output, the plot shows the model alone.

        Returns
        -------
        Plot
            Plot that a notebook displays. `Plot.save` writes it as HTML or SVG.

        Examples
        --------
        >>> import hystfmu as hy
        >>> data = hy.synthetic.piezo(60, 1000.0)
        >>> hy.fit(data, "prandtl_ishlinskii").plot(data)
        Plot('prandtl_ishlinskii: y over u', measured, model)
        """
        from hystfmu.data.reader.reading import dataset_of
        from hystfmu.model import run_along

        self._one_to_one("plot")
        other = dataset_of(other, output=False)
        lines = [Line("measured", other.u, other.y)] if other.has_output else []
        lines.append(Line("model", other.u, run_along(self.graph, other)))
        source, sink = self.graph.inputs[0], self.graph.outputs[0]
        u, y = with_unit("u", other.unit_u or source.unit), with_unit("y", other.unit_y or sink.unit)
        return Plot(f"{self.key}: y over u", u, y, lines, points=LOOP_POINTS)

    def report(self, data: Dataset | Columns, path: str | Path) -> Path:
        """Write an HTML page about the fit: errors, interval for new rows, loops, residuals, parameters, warnings.

        Parameters
        ----------
        data : Dataset or data frame
            Data to which the model was fitted. `Dataset.train` must contain the same training rows.
        path : str or Path
            File to write, ``*.html``. The method returns this path.

        Raises
        ------
        InputError
            The measured output is missing, or the file cannot be written.

        Examples
        --------
        >>> import hystfmu as hy
        >>> data = hy.synthetic.piezo(60, 1000.0).with_train(":9000")
        >>> hy.fit(data, "prandtl_ishlinskii").report(data, "piezo.html").name
        'piezo.html'
        """
        from hystfmu.base import write_text
        from hystfmu.data.reader.reading import dataset_of
        from hystfmu.face.page import fit_page

        self._one_to_one("report")
        data = dataset_of(data)
        if not data.has_output:
            where = data.path or data.name
            raise InputError(f"{where}: The data must have a measured output to compare with. Got none.")
        write_text(path, fit_page(self, data))
        return Path(path)

    def inverse(
        self,
        method: InverseMethod = "auto",
        seed: int = 0,
        progress: Callable[[float], None] = lambda fraction: None,
        **options: Any,
    ) -> Model:
        """Compute the inverse: a model whose input `u` is the wanted output and whose output `y` is the input to apply.

        Parameters
        ----------
        method : {"auto", "exact", "implicit", "learned", "adaptive"}
            exact: invert each block of the model. implicit: solve the equation of a static model for the input in every
            step. learned: train a network on the response of the model with input and output exchanged
            (`hystfmu.inverse.learned`). adaptive: adapt the weights of an exact inverse to the measured output during
            operation (`hystfmu.inverse.adaptive`). auto: use the first possible method of exact, implicit and learned.
        seed : int
            Seed of the training of a learned inverse.
        progress : function, optional
            Called with the completed fraction, 0 to 1, during the training of a learned inverse.
        **options
            Options of the method. implicit: ``lo`` and ``hi``, the range of the searched input. learned: the options of
            the kind of model ``play_bank_mlp``. adaptive: ``f_n``, ``zeta``, ``delay``, ``T`` and the other parameters
            of the block ``adaptive_inverse``.

        Returns
        -------
        Model
            Inverse model. `fit` contains the errors of inverse and model in series, and a warning if these errors are
            large. If the model has linear dynamics or a delay behind the hysteresis, the output lags the wanted output
            by ``fit["lag_steps"]`` steps, or ``fit["lag"]`` seconds. The output is accurate up to the frequency
            ``fit["band"]`` (Hz). To compensate the lag, shift the reference to an earlier time.

        Raises
        ------
        InputError
            The inverse does not exist. The message states the reason and a remedy.

        Examples
        --------
        >>> import hystfmu as hy
        >>> model = hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii")
        >>> model.inverse().provenance["inverse"]
        'exact'
        """
        from hystfmu.inverse import inverse

        return inverse(self, method, seed, progress, **options)

    def with_in_range(self) -> Model:
        """Return the model with an additional output ``in_range``.

        The output ``in_range`` is 1 if the input lies in the range of the training rows, else 0.

        For an inverse, ``in_range`` is 1 if the output of the inverse lies in this range, without the two ends of the
        range. An implicit inverse returns an end if it cannot reach the wanted output. The output ``in_range`` also
        exists in exports, units and scenarios of the model.

        Raises
        ------
        InputError
            The model does not state the range of the training rows (provenance ``trained_u``).

        Examples
        --------
        >>> import hystfmu as hy
        >>> model = hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii").with_in_range()
        >>> lo, hi = model.provenance["trained_u"]
        >>> model.predict([lo, hi, hi + 1])[:, 1].tolist()
        [1.0, 1.0, 0.0]
        """
        from hystfmu.model.coverage import with_in_range

        return with_in_range(self)

    def export(
        self,
        path: str | Path,
        fmi: Literal[2, 3] = 2,
        name: str | None = None,
        platforms: Literal["host", "all"] = "host",
        source: bool = False,
    ) -> Path:
        """Write an FMU for Co-Simulation and Model Exchange. The export needs no compiler.

        If the model states its input range, the documentation page in the FMU can simulate the model.

        Parameters
        ----------
        path : str or Path
            FMU file to write, with the ending ``.fmu``. If an error occurs, no incomplete file remains.
        fmi : {2, 3}
            Version of the FMI standard.
        name : str, optional
            Model name, which may be any text. The default is the name of the record and the kind of model. The model
            identifier consists of the first 60 characters of the name. In it, _ replaces each character that is not an
            ASCII letter or a digit.
        platforms : {"host", "all"}
            Platforms on which the FMU can run: "host" for this machine, or "all". The FMU contains a binary for each of
            them. A missing binary is an error.
        source : bool
            Whether to add the C source to the FMU. It is one C99 file; it needs only the headers of the FMI standard
            and the C library.

        Raises
        ------
        InputError
            The version, the path, the name or the platform is invalid, or the file cannot be written.

        Examples
        --------
        >>> import hystfmu as hy
        >>> hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii").export("piezo.fmu", fmi=3).name
        'piezo.fmu'
        """
        from hystfmu.face.page import explorer_of
        from hystfmu.fmu.write.export import export_fmu

        return export_fmu(self, path, fmi, name, platforms, source, explorer_of(self))

    def export_modelica(
        self, folder: str | Path, source: str = "a model in memory", sheet: Mapping[str, float] | None = None
    ) -> Path:
        """Write a Modelica package with the record ``Values``, the block ``Model`` and the model ``Example``.

        If the output is a length, and the input is in volts or amperes, the package also contains ``Actuator`` and
        ``ActuatorExample``. ``Actuator`` is a piezo or magnetostrictive actuator in SI units with electrical pins and
        mechanical flanges. ``ActuatorExample`` moves a mass with this actuator.

        Parameters
        ----------
        folder : str or Path
            Folder of the package. The last part of the path is the name of the package, e.g. ``"Piezo/"``.
        source : str
            Origin of the model. This text is part of the documentation of the package.
        sheet : mapping of (str, float), optional
            Data-sheet values in SI units. ``stroke`` and ``blocking_force`` must be given together. ``resonance`` is
            the natural frequency (Hz) of the actuator with one fixed end, and ``damping`` is its damping ratio.
            For volts, ``capacitance`` is the small-signal value (F), and ``capacitance_ratio`` is the mean value
            divided by the small-signal value, by default 1.6. For amperes, ``inductance`` is the mean value (H), and
            ``resistance`` is the resistance of the coil (ohm).

        Raises
        ------
        InputError
            The name is not valid in Modelica, a block has no Modelica class, or the folder contains other files.

        Examples
        --------
        >>> import hystfmu as hy
        >>> hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii").export_modelica("Piezo/").name
        'Piezo'
        """
        from hystfmu.modelica.package import export_modelica

        target = Path(folder)
        return export_modelica(self, target.parent, target.name, source, sheet)

    def unit(self) -> Unit:
        """Return a co-simulation unit with the ports and functions of the exported FMU, and with bit-identical results.

        Examples
        --------
        >>> import hystfmu as hy
        >>> unit = hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii").unit()
        >>> unit.initialize(0.0, u=1.5)
        >>> unit.set("u", 2.0)
        >>> unit.do_step(0.0, 1e-3)
        >>> bool(unit.get("y") == unit.graph.run([1.5, 2.0])[1])
        True
        """
        return Unit(self.graph)

    # ---- for people -------------------------------------------------------------------------------------------------
    def __repr__(self) -> str:
        """Return one line of text with kind of model, ports, number of parameters and error."""
        from hystfmu.face.page import names

        parts = [repr(self.key), f"{names(self, 'input')} -> {names(self, 'output')}"]
        if "parameters" in self.fit:
            parts.append(f"{self.fit['parameters']} parameters")
        if "cascade_rms_percent" in self.fit:
            parts.append(f"in cascade RMS {self.fit['cascade_rms_percent']:.2g} %")
        elif "rms_percent" in self.fit:
            parts.append(f"RMS {self.fit['rms_percent']:.2g} %")
        return f"Model({', '.join(parts)})"

    def __str__(self) -> str:
        """Return one screen of text with kind of model, ports, parameters, errors and warnings."""
        from hystfmu.face.page import evidence_lines, tables
        from hystfmu.report.terminal import table as columns

        lines = [f"{self.key}: {self.text}" if self.text else self.key]
        for part in tables(self):
            lines += ["", columns(part.head, part.rows)]
        lines += ["", *shown] if (shown := evidence_lines(self)) else []
        return "\n".join([*lines, *(f"\nwarning: {w}" for w in self.fit.get("warnings", ()))])

    def _repr_html_(self) -> str:
        """Return the text that `print` shows as HTML for a notebook."""
        from hystfmu.face.page import evidence_lines, tables

        warnings = "".join(f"<p><b>warning:</b> {escape(w)}</p>" for w in self.fit.get("warnings", ()))
        title = f"<p><b>{escape(self.key)}</b>{': ' if self.text else ''}{escape(self.text)}</p>"
        shown = "".join(f"<p>{escape(line)}</p>" for line in evidence_lines(self))
        return title + "".join(map(table, tables(self))) + shown + warnings

    def _one_to_one(self, verb: str) -> None:
        sizes = [p.size for p in self.graph.ports if p.kind == "input"]
        if not sizes or max(sizes) > 1 or self.graph.n_outputs != 1:
            raise InputError(
                f"The model of {verb}() must have one output, one input and covariates beside it. "
                f"Got {self.graph.n_inputs} inputs and {self.graph.n_outputs} outputs of {self.key}."
            )
