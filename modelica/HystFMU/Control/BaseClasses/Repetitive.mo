// generated from the table of fmu_build/core/blocks/controllers/repetitive.c by `make generate` - do not edit
within HystFMU.Control.BaseClasses;
partial block Repetitive "Repetitive control: corrects the reference by the errors of the last period: parameters and ports"
  extends Icons.Block;
  parameter Integer n(min = 2) = 20 "Steps per period" annotation (Dialog(group = "Sizes"));
  parameter Integer n_q(min = 0) = 1 "Taps of Q on each side, below n" annotation (Dialog(group = "Sizes"));
  parameter Integer n_l(min = 0) = 1 "Taps of L on each side, below n" annotation (Dialog(group = "Sizes"));
  parameter Real q[n_q + 1] = fill(0.0, n_q + 1) "Taps of Q: the middle tap, then one side" annotation (Dialog(group = "Controller"));
  parameter Real l[2*n_l + 1] = fill(0.0, 2*n_l + 1) "Taps of L, from n_l steps back to n_l steps ahead" annotation (Dialog(group = "Controller"));
  Interfaces.RealInput y_d "Reference" annotation (Placement(transformation(extent = {{-120, 43}, {-100, 63}})));
  Interfaces.RealInput y "Measured output of the plant" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
  Interfaces.RealInput active "Learning is off if active <= 0" annotation (Placement(transformation(extent = {{-120, -64}, {-100, -44}})));
  Interfaces.RealOutput r "Corrected reference for the controller" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> r_k = y_d + w_k, w_k = sum_j q_|j| w_(k-n+j) + sum_j l_j e_(k-n+j), e = y_d - y.</p>
<p><b>Source:</b> Hara, Yamamoto, Omata &amp; Nakano, IEEE Trans. Automat. Control 33 (1988) 659-668; zero phase: Tomizuka, Tsao &amp; Chew, ASME J. Dyn. Syst. Meas. Control 111 (1989) 353-358.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.Repetitive\">Validation.Repetitive</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.Repetitive\">Control.Repetitive</a>.</p>
</html>"));
end Repetitive;
