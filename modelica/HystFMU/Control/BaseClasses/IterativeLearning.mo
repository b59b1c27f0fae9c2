// generated from the table of fmu_build/core/blocks/controllers/iterative_learning.c by `make generate` - do not edit
within HystFMU.Control.BaseClasses;
partial block IterativeLearning "Iterative learning control: corrections from the errors of earlier periods: parameters and ports"
  extends Interfaces.Controller;
  parameter Integer n(min = 1) = 20 "Steps per period of the reference" annotation (Dialog(group = "Sizes"));
  parameter Real gain = 0 "Learning gain; 0: no learning" annotation (Dialog(group = "Gains"));
  parameter Integer lead(min = 0, max = 1000000) = 1 "Steps from a command to its effect" annotation (Dialog(group = "Controller"));
  parameter Real smooth(min = 0, max = 0.25) = 0 "Weight of each neighbour in the filter; 0: no filter" annotation (Dialog(group = "Weights"));
  parameter Real u_min = -1e300 "Lower limit of u" annotation (Dialog(group = "Limits"));
  parameter Real u_max = 1e300 "Upper limit of u" annotation (Dialog(group = "Limits"));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u_k = u_ff + w_k; after each period w_k &lt;- Q (w_k + gain e_(k + lead)), e = y_d - y, Q w_k = smooth w_(k-1) + (1 - 2 smooth) w_k + smooth w_(k+1).</p>
<p><b>Source:</b> Arimoto, Kawamura &amp; Miyazaki 1984; Bristow, Tharayil &amp; Alleyne, IEEE Control Systems 26 (2006) 96.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Examples.IterativeLearning\">Examples.IterativeLearning</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.IterativeLearning\">Control.IterativeLearning</a>, <a href=\"modelica://HystFMU.Validation.IterativeLearning\">Validation.IterativeLearning</a>.</p>
</html>"));
end IterativeLearning;
