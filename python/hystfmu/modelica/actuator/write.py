"""Files of an actuator: the class with all values, and its example."""

from __future__ import annotations

from collections.abc import Mapping

from hystfmu.base.errors import InputError
from hystfmu.base.printable import escape
from hystfmu.model import Model
from hystfmu.modelica.actuator.example import actuator_example
from hystfmu.modelica.actuator.made import Made, made, refusal
from hystfmu.modelica.actuator.sheet import Sheet
from hystfmu.modelica.literals import number, string

ACTUATOR = ("Actuator", "ActuatorExample")  # classes in a package


def actuator_files(model: Model, within: str, told: str, values: Mapping[str, float] | None) -> dict[str, str]:
    """Return the files of the actuator by class; empty if the model is not an actuator and has no data sheet.

    Parameters
    ----------
    model : Model
    within : str
        Name of the package.
    told : str
        Fit quality and provenance as HTML.
    values : mapping of (str, float) or None
        Data sheet; None if no data sheet is known.

    Raises
    ------
    InputError
        The model has a data sheet but is not an actuator, or the data sheet is impossible.
    """
    why = refusal(model)
    if why and values is not None:
        raise InputError(f"a data sheet makes an actuator, and {why}")
    if why:
        return {}
    a, (part, shown) = made(model, Sheet.of(values or {})), ACTUATOR
    return {part: actuator(model, a, part, within, told), shown: actuator_example(a, shown, within, part)}


def actuator_told(model: Model, values: Mapping[str, float] | None) -> list[str]:
    """Return the sources of mass, stiffness and capacitance of the actuator, or the reason for none; one line each."""
    if why := refusal(model):
        return [f"no actuator: {why}"]
    return list(made(model, Sheet.of(values or {})).mechanics.told)


def actuator(model: Model, a: Made, name: str, within: str, history: str = "") -> str:
    """Return the file of the actuator, without its first line (the mark).

    Parameters
    ----------
    model : Model
        Identified model.
    a : Made
        Actuator of the model.
    name, within : str
        Name of the class and of its package.
    history : str
        Fit quality and provenance as HTML.
    """
    s, p, form = a.slot, a.mechanics, a.form
    scaling = {
        "gain": s.gain / a.unit,
        "shift": s.shift,
        "scale": s.scale * a.metre,
        "offset": s.offset * a.metre,
    }
    own = [f"{k} = {v}" for k, v in s.values.items()] + [f"{k} = {number(v)}" for k, v in scaling.items()]
    values = {form.limit: number(p.most), form.symbol: number(p.C)}
    values |= {k: number(getattr(p, k)) for k in ("stroke", "k", "c", "share", "resistance", "tau")}
    values |= {"withMass": "false"} if p.m is None else {"m": number(p.m)}
    values[form.start] = number(a.start)
    given = [f"{k} = {v}" for k, v in values.items()]
    own.insert(0, f"u_start = {values[form.start]}")
    given.append(f"redeclare HystFMU.Actuators.Hysteresis.{s.name} hysteresis({', '.join(own)})")
    modifiers = ",\n    ".join(given)
    return f"""within {within};
model {name} "{form.text} with the identified hysteresis, in SI units"
  extends HystFMU.Actuators.BaseClasses.{form.base}(
    {modifiers});
  annotation (Documentation(info = {string(_documentation(model, a, within, history))}));
end {name};
"""


def _documentation(model: Model, a: Made, within: str, history: str) -> str:
    p, form = a.mechanics, a.form
    limits = [f"identified from {a.low:g} to {a.high:g} {form.unit}"]
    limits += [f"{text} is left out" for text in a.slot.left_out]
    if len(model.graph.inputs) > 1:
        limits.append(f"follows {form.warmed}, within the range of its training")
    limits += p.told
    if p.f_n is not None and p.lowest is not None:
        limits.append(
            f"the resonance is {p.f_n:.4g} Hz for small vibrations about {a.start:.4g} {form.unit}, and falls "
            f"towards {p.lowest:.4g} Hz over the whole range, where the material follows the force"
        )
    base = f"HystFMU.Actuators.BaseClasses.{form.base}"
    return (
        f"<html><p><b>Equation:</b> that of {base}; in its slot "
        f"HystFMU.Actuators.Hysteresis.{a.slot.name}.</p>{history}"
        f"<p><b>Source:</b> a model of kind {escape(model.key)}; the limitations state all other sources.</p>"
        f"<p><b>Limitations:</b> {'; '.join(limits)}.</p>"
        f'<p><b>Example:</b> <a href="modelica://{within}.ActuatorExample">ActuatorExample</a>.</p>'
        f'<p><b>See also:</b> <a href="modelica://{base}">{base}</a>.</p></html>'
    )
