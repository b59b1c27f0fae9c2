within HystFMU.Actuators.BaseClasses;
model Inertia "Mass at the end of an actuator"
  extends Icons.Component;
  parameter Types.Mass m(min = 0) = 0.02 "Mass, greater than 0" annotation (Dialog(group = "Parameters"));
  parameter Types.Start start = Types.Start.rest "Initial state: position without load, or in equilibrium" annotation (Dialog(group = "Start"));
  parameter Types.Velocity v_start = 0 "Velocity at the start" annotation (Dialog(group = "Start"));
  Interfaces.Flange flange "Flange of the mass" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput rest(unit = "m") "Initial position without load" annotation (Placement(transformation(extent = {{-120, 50}, {-100, 70}})));
  Types.Position s(nominal = 1e-5) "Position";
  Types.Velocity v(nominal = 0.01) "Velocity";
initial equation
  v = v_start;
  if start == Types.Start.steady then
    flange.f = 0;
  else
    s = rest;
  end if;
equation
  s = flange.s;
  der(s) = v;
  m*der(v) = flange.f;
  annotation (
    Icon(graphics = {Rectangle(extent = {{-50, -45}, {50, 45}}, lineColor = {64, 64, 64}, fillColor = {160, 160, 160}, fillPattern = FillPattern.Solid)}),
    Documentation(info = "<html>
<p><b>Equation:</b> m s'' = f.</p>
<p><b>Source:</b> Newton's second law.</p>
<p><b>Limitations:</b> one direction.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Piezo\">Actuators.BaseClasses.Piezo</a>, which uses it.</p>
</html>"));
end Inertia;
