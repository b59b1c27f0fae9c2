// generated from the table of fmu_build/core/blocks/controllers/disturbance_observer.c by `make generate` - do not edit
within HystFMU.Control.BaseClasses;
partial block DisturbanceObserver "Disturbance observer: subtracts an estimated input disturbance from the command: parameters and ports"
  extends Icons.Block;
  parameter Integer n(min = 1) = 1 "Steps from a command to its response in y; 1: no delay" annotation (Dialog(group = "Sizes"));
  parameter Types.Frequency f_n(min = 0) = 1 "Natural frequency of the plant; greater than 0" annotation (Dialog(group = "Dynamics"));
  parameter Real zeta(min = 0) = 0.7 "Damping ratio of the plant" annotation (Dialog(group = "Dynamics"));
  parameter Real gain = 1 "Static gain of the plant, not 0" annotation (Dialog(group = "Gains"));
  parameter Types.Frequency f_o(min = 0) = 0.5 "Bandwidth of the observer; greater than 0" annotation (Dialog(group = "Filters"));
  parameter Real u_min = -1e300 "Lower limit of u" annotation (Dialog(group = "Limits"));
  parameter Real u_max = 1e300 "Upper limit of u" annotation (Dialog(group = "Limits"));
  Interfaces.RealInput u_c "Command for the undisturbed plant" annotation (Placement(transformation(extent = {{-120, 30}, {-100, 50}})));
  Interfaces.RealInput y "Measured output of the plant" annotation (Placement(transformation(extent = {{-120, -50}, {-100, -30}})));
  Interfaces.RealOutput u "Command minus the estimated disturbance" annotation (Placement(transformation(extent = {{100, 30}, {120, 50}})));
  Interfaces.RealOutput d_hat "Estimated disturbance at the input of the plant" annotation (Placement(transformation(extent = {{100, -50}, {120, -30}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = u_c - d_hat; d_hat: observer of y'' = omega_n<sup>2</sup> (gain (u + d) - y) - 2 zeta omega_n y', d' = 0, poles at exp(-2 pi f_o h).</p>
<p><b>Source:</b> Ohnishi 1987; Johnson, IEEE Trans. Automat. Control 16 (1971) 635; poles: Gao, ACC 2003.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.PidObserver\">Examples.PidObserver</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.DisturbanceObserver\">Control.DisturbanceObserver</a>, <a href=\"modelica://HystFMU.Validation.DisturbanceObserver\">Validation.DisturbanceObserver</a>.</p>
</html>"));
end DisturbanceObserver;
