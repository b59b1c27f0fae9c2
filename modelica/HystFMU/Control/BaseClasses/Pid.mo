// generated from the table of fmu_build/core/blocks/controllers/pid.c by `make generate` - do not edit
within HystFMU.Control.BaseClasses;
partial block Pid "PID controller with feed-forward and anti-windup: parameters and ports"
  extends Interfaces.Controller;
  parameter Real Kp = 0 "Proportional gain" annotation (Dialog(group = "Gains"));
  parameter Real Ki(unit = "1/s") = 0 "Integral gain" annotation (Dialog(group = "Gains"));
  parameter Types.Time Kd = 0 "Derivative gain" annotation (Dialog(group = "Gains"));
  parameter Types.Time tau(min = 0) = 0 "Time constant of the derivative filter; 0: none" annotation (Dialog(group = "Filters"));
  parameter Real u_min = -1e300 "Lower limit of u" annotation (Dialog(group = "Limits"));
  parameter Real u_max = 1e300 "Upper limit of u" annotation (Dialog(group = "Limits"));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = u_ff + Kp e + Ki int e dt + Kd de/dt, e = y_d - y.</p>
<p><b>Source:</b> Astrom &amp; Hagglund, PID Controllers, 2nd ed. 1995, chapter 3.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.BoucWen\">Examples.BoucWen</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Pid\">Control.Pid</a>, <a href=\"modelica://HystFMU.Examples.Duhem\">Examples.Duhem</a>, <a href=\"modelica://HystFMU.Examples.Pid\">Examples.Pid</a>, <a href=\"modelica://HystFMU.Examples.StackInLoop\">Examples.StackInLoop</a>, <a href=\"modelica://HystFMU.Validation.Pid\">Validation.Pid</a>.</p>
</html>"));
end Pid;
