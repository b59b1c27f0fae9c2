"""The two forms of an actuator: a piezo driven by voltage, and a magnetostrictive rod driven by current.

Their equations are dual: current corresponds to voltage, inductance to capacitance, flux linkage to charge.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Form:
    """Names of a form in the library, and default values if no data sheet states them.

    Attributes
    ----------
    unit : str
        Unit of the input: V or A.
    base, text : str
        Base class, and description of an exported class.
    limit, start : str
        Parameters of the base class for range and start of the input.
    store, symbol, store_unit : str
        Element that stores the electrical energy: name in the data sheet, parameter, and unit.
    stiffness : float
        Stiffness while the input is held (N/m).
    size, coupled : str
        Example device with this stiffness, and example material with the assumed coupling.
    resistance : float
        Resistance of the leads or of the coil (ohm).
    tau : float
        Time constant of the relaxation, or lag of the eddy currents (s).
    leads : bool
        Whether the resistance acts on small vibrations. It does not act on vibrations about a held current.
    warmed : str
        Temperature for a slot that depends on a temperature.
    """

    unit: str
    base: str
    text: str
    limit: str
    start: str
    store: str
    symbol: str
    store_unit: str
    stiffness: float
    size: str
    coupled: str
    resistance: float
    tau: float
    leads: bool
    warmed: str


# Square of the coupling factor where no sheet says it, of both forms.  d33^2/(s33 eps33), IEEE Std 176-1987, of the
# soft ceramic PIC255 (PI Ceramic, Piezo Material Data: 400e-12 m/V, 20.7e-12 m2/N, 1750 eps0; its measured k33 of 0.69
# gives 0.48); k33 of Terfenol-D is 0.7 (Engdahl, Handbook of Giant Magnetostrictive Materials, 2000).
COUPLING = 0.5
PIEZO = Form(
    "V",
    "Piezo",
    "Piezo actuator",
    "v_max",
    "v_start",
    "capacitance",
    "C",
    "F",
    2e7,  # A/(s33 L) is 3.4e7 for the bare ceramic
    "in short circuit, of the size of a stack of 5 x 5 x 36 mm",
    "as d33, s33 and eps33 of PIC255 do",
    1.0,
    1e-5,
    True,
    "the temperature of the heat port, else T_fixed",
)
ROD = Form(
    "A",
    "Magnetostrictive",
    "Magnetostrictive actuator",
    "i_max",
    "i_start",
    "inductance",
    "L",
    "H",
    3e7,  # E A/L with 30 GPa at constant field
    "at constant current, of the size of a rod of Terfenol-D of 8 x 50 mm",
    "as k33 of Terfenol-D, 0.7, does",
    2.0,
    1e-4,
    False,
    "T_fixed",
)
FORMS = {f.unit: f for f in (PIEZO, ROD)}
