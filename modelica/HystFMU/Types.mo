within HystFMU;
package Types "Quantities with units, and enumerations"
  extends Icons.Package;

  type Time = Real(final quantity = "Time", final unit = "s") "Time in seconds"
    annotation (Documentation(info = "<html><p>Time, s.</p></html>"));
  type Frequency = Real(final quantity = "Frequency", final unit = "Hz") "Frequency in hertz"
    annotation (Documentation(info = "<html><p>Frequency, Hz.</p></html>"));
  type Angle = Real(final quantity = "Angle", final unit = "rad") "Phase angle in radians"
    annotation (Documentation(info = "<html><p>Angle, rad.</p></html>"));
  type Voltage = Real(final quantity = "ElectricPotential", final unit = "V", nominal = 10) "Electric potential"
    annotation (Documentation(info = "<html><p>Electric potential, V.</p></html>"));
  type Current = Real(final quantity = "ElectricCurrent", final unit = "A", nominal = 1e-2) "Electric current"
    annotation (Documentation(info = "<html><p>Electric current, A.</p></html>"));
  type Resistance = Real(final quantity = "Resistance", final unit = "Ohm") "Resistance"
    annotation (Documentation(info = "<html><p>Resistance, Ohm.</p></html>"));
  type Capacitance = Real(final quantity = "Capacitance", final unit = "F", displayUnit = "uF") "Capacitance"
    annotation (Documentation(info = "<html><p>Capacitance, F.</p></html>"));
  type Position = Real(final quantity = "Length", final unit = "m", displayUnit = "um", nominal = 1e-5) "Position"
    annotation (Documentation(info = "<html><p>Position, m.</p></html>"));
  type Velocity = Real(final quantity = "Velocity", final unit = "m/s", nominal = 1e-2) "Velocity"
    annotation (Documentation(info = "<html><p>Velocity, m/s.</p></html>"));
  type Force = Real(final quantity = "Force", final unit = "N", nominal = 10) "Force"
    annotation (Documentation(info = "<html><p>Force, N.</p></html>"));
  type Mass = Real(final quantity = "Mass", final unit = "kg") "Mass"
    annotation (Documentation(info = "<html><p>Mass, kg.</p></html>"));
  type Stiffness = Real(final quantity = "TranslationalSpringConstant", final unit = "N/m") "Stiffness"
    annotation (Documentation(info = "<html><p>Stiffness, N/m.</p></html>"));
  type Damping = Real(final quantity = "TranslationalDampingConstant", final unit = "N.s/m") "Viscous damping"
    annotation (Documentation(info = "<html><p>Viscous damping, N.s/m.</p></html>"));
  type Charge = Real(final quantity = "ElectricCharge", final unit = "C") "Electric charge"
    annotation (Documentation(info = "<html><p>Electric charge, C.</p></html>"));
  type Power = Real(final quantity = "Power", final unit = "W") "Power"
    annotation (Documentation(info = "<html><p>Power, W.</p></html>"));
  type Energy = Real(final quantity = "Energy", final unit = "J") "Energy"
    annotation (Documentation(info = "<html><p>Energy, J.</p></html>"));
  type Temperature = Real(final quantity = "ThermodynamicTemperature", final unit = "K", displayUnit = "degC") "Absolute temperature"
    annotation (Documentation(info = "<html><p>Absolute temperature, K.</p></html>"));
  type Memory = enumeration(
      dominant "Dominant extrema: wiping-out (Madelung) memory",
      last "Only the last extremum, as the paper literally states") "Extrema that an operator stores"
    annotation (Documentation(info = "<html><p>Extrema of the input that an operator stores.</p></html>"));
  type Activation = enumeration(
      sigmoid "1/(1 + exp(-s))",
      tanh "tanh(s)",
      relu "max(s, 0)") "Activation of the hidden layer"
    annotation (Documentation(info = "<html><p>Activation of the hidden layer of a network.</p></html>"));

  type Recursion = enumeration(
      corrected "Dead zone, corrected",
      printed "Dead zone, as printed",
      plain "Without dead zone") "Form of recursive least squares"
    annotation (Documentation(info = "<html><p>Form of recursive least squares.</p></html>"));

  type Magnetisation = enumeration(
      demagnetised "Demagnetised by loops of decreasing size",
      low "Negative saturation",
      high "Positive saturation") "Initial state of a Preisach operator"
    annotation (Documentation(info = "<html><p>Initial state of a Preisach operator.</p></html>"));

  type Start = enumeration(
      rest "Zero states",
      steady "In equilibrium with the first input") "Initial state of linear dynamics"
    annotation (Documentation(info = "<html><p>Initial state of linear dynamics.</p></html>"));

  type Switching = enumeration(
      smooth "s/(abs(s) + epsilon)",
      saturation "sat(s/epsilon)") "Switching term of a sliding mode controller"
    annotation (Documentation(info = "<html><p>Switching term of a sliding mode controller.</p></html>"));

  annotation (Documentation(info = "<html>
<p>Dimensionless quantities, and quantities in units that the user chooses (volts, micrometres, normalised), have the type Real.</p>
</html>"));
end Types;
