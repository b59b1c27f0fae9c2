within HystFMU.Loops;
partial block Observed "A controller and a disturbance observer"
  extends Interfaces.Controller;
  parameter Types.Time Ts = 1e-4 "Sample period" annotation (Dialog(group = "Sampling"));
  replaceable Interfaces.Controller controller constrainedby Interfaces.Controller annotation (choicesAllMatching = true, Placement(transformation(extent = {{-60, -10}, {-40, 10}})));
  Control.DisturbanceObserver observer(n = 2, f_n = 500, zeta = 0.7, gain = 1, Ts = Ts) "Subtracts the remaining hysteresis as a disturbance" annotation (Placement(transformation(extent = {{20, -10}, {40, 10}})));
equation
  connect(y_d, controller.y_d) annotation (Line(points = {{-110, 53}, {-85.5, 53}, {-85.5, 5.3}, {-61, 5.3}}, color = {0, 0, 127}));
  connect(y, controller.y) annotation (Line(points = {{-110, 0}, {-61, 0}}, color = {0, 0, 127}));
  connect(u_ff, controller.u_ff) annotation (Line(points = {{-110, -54}, {-85.5, -54}, {-85.5, -5.4}, {-61, -5.4}}, color = {0, 0, 127}));
  connect(controller.u, observer.u_c) annotation (Line(points = {{-39, 0}, {-10, 0}, {-10, 4}, {19, 4}}, color = {0, 0, 127}));
  connect(y, observer.y) annotation (Line(points = {{-110, 0}, {-45.5, 0}, {-45.5, -4}, {19, -4}}, color = {0, 0, 127}));
  connect(observer.u, u) annotation (Line(points = {{41, 4}, {75.5, 4}, {75.5, 0}, {110, 0}}, color = {0, 0, 127}));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> equations of the controller and of Control.DisturbanceObserver; inverse and plant in series are an almost linear plant for the observer.</p>
<p><b>Source:</b> the scenarios pid_observer and lead_lag.</p>
<p><b>Limitations:</b> as for the two blocks.</p>
<p><b>Example:</b> <code>extends Observed(redeclare Control.Pid controller(Ts = Ts));</code> in <a href=\"modelica://HystFMU.Loops.ObservedPid\">Loops.ObservedPid</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.DisturbanceObserver\">Control.DisturbanceObserver</a>.</p>
</html>"));
end Observed;
