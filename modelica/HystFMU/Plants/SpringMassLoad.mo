within HystFMU.Plants;
model SpringMassLoad "Mass with spring and damper against the ground"
  extends Icons.Component;
  parameter Types.Mass m(min = 0) = 0.5 "Mass, greater than 0" annotation (Dialog(group = "Parameters"));
  parameter Types.Damping c(min = 0) = 500 "Damping" annotation (Dialog(group = "Parameters"));
  parameter Types.Stiffness k(min = 0) = 1e6 "Stiffness" annotation (Dialog(group = "Parameters"));
  parameter Boolean fixedStart = false "True if it starts at s = 0 and v = 0; false if a rigidly connected mass has initial values" annotation (Dialog(group = "Start"));
  Interfaces.Flange flange "Flange of the mass" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Types.Position s(start = 0, fixed = fixedStart) "Position";
  Types.Velocity v(start = 0, fixed = fixedStart) "Velocity";
equation
  flange.s = s;
  der(s) = v;
  m*der(v) = flange.f - c*v - k*s;
  annotation (
    Icon(graphics = {Rectangle(extent = {{-70, -40}, {-20, 40}}, lineColor = {64, 64, 64}, fillColor = {160, 160, 160}, fillPattern = FillPattern.Solid), Line(points = {{-20, 0}, {-7, 20}, {7, -20}, {20, 20}, {33, -20}, {47, 20}, {60, 0}}, color = {64, 64, 64}), Line(points = {{60, -50}, {60, 50}}, color = {64, 64, 64})}),
    Documentation(info = "<html>
<p><b>Equation:</b> m s'' + c s' + k s = f.</p>
<p><b>Source:</b> Newton's second law.</p>
<p><b>Limitations:</b> linear. If the load is rigidly connected to an actuator with a mass, both have the initial values of the actuator. If the load is the only mass, set <code>fixedStart = true</code>.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.Stack\">Actuators.Stack</a>.</p>
</html>"));
end SpringMassLoad;
