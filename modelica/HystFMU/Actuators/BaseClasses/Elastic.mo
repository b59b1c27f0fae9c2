within HystFMU.Actuators.BaseClasses;
model Elastic "Elastic body with a free stroke, damping and preload"
  extends Icons.Component;
  parameter Types.Stiffness k(min = 0) = 4e7 "Stiffness of an element at constant stroke, greater than 0" annotation (Dialog(group = "Parameters"));
  parameter Types.Damping c(min = 0) = 20 "Damping between the flanges, greater than 0" annotation (Dialog(group = "Parameters"));
  parameter Types.Stiffness k_pre(min = 0) = 0 "Stiffness of the preload spring" annotation (Dialog(group = "Parameters"));
  parameter Types.Position stroke_start = 0 "Initial free stroke of an element" annotation (Dialog(group = "Start"));
  parameter Integer n_series(min = 1) = 1 "Number of elements in series" annotation (Dialog(group = "Parameters"));
  parameter Integer n_parallel(min = 1) = 1 "Number of elements in parallel" annotation (Dialog(group = "Parameters"));
  Interfaces.Flange flange_a "Fixed end" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.Flange flange_b "Moving end" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  Interfaces.RealInput stroke(unit = "m") "Free stroke of an element" annotation (Placement(transformation(extent = {{-10, 100}, {10, 120}})));
  Interfaces.RealOutput rest(unit = "m") "Initial position of flange_b without load" annotation (Placement(transformation(extent = {{100, 50}, {120, 70}})));
  Types.Force F(nominal = 100) "Tension of an element";
  Types.Position s_rel(nominal = 1e-5) "Distance of the flanges minus their distance without stroke and load";
  Types.Velocity v_rel(nominal = 0.01) "Rate of s_rel";
  Types.Energy stored(nominal = 1e-3) "Elastic energy";
equation
  s_rel = flange_b.s - flange_a.s;
  v_rel = der(s_rel);
  F = k*(s_rel/n_series - stroke);
  flange_b.f = n_parallel*F + k_pre*s_rel + c*v_rel;
  flange_a.f = -flange_b.f;
  rest = flange_a.s + n_parallel*k*stroke_start/(n_parallel*k/n_series + k_pre);
  stored = 0.5*n_series*n_parallel*F^2/k + 0.5*k_pre*s_rel^2;
  annotation (
    Icon(graphics = {Line(points = {{-70, 0}, {-52, 20}, {-35, -20}, {-18, 20}, {0, -20}, {18, 20}, {35, -20}, {52, 20}, {70, 0}}, color = {64, 64, 64})}),
    Documentation(info = "<html>
<p><b>Equation:</b> F = k (s_rel/n_series - stroke), f = n_parallel F + k_pre s_rel + c s_rel'.</p>
<p><b>Source:</b> Hooke's law.</p>
<p><b>Limitations:</b> linear, no mass.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.StackMovesMass\">Examples.StackMovesMass</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Actuators.BaseClasses.Piezo\">Actuators.BaseClasses.Piezo</a>, which uses it.</p>
</html>"));
end Elastic;
