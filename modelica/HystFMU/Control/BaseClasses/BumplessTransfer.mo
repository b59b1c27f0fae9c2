// generated from the table of fmu_build/core/blocks/controllers/bumpless_transfer.c by `make generate` - do not edit
within HystFMU.Control.BaseClasses;
partial block BumplessTransfer "Bumpless transfer: the output changes from the present command to a new one without a jump: parameters and ports"
  extends Icons.Block;
  parameter Types.Time T(min = 0) = 1 "Duration of the transfer; greater than 0" annotation (Dialog(group = "Dynamics"));
  Interfaces.RealInput u_c "New command" annotation (Placement(transformation(extent = {{-120, 30}, {-100, 50}})));
  Interfaces.RealInput u_present "Present command (1e300: none)" annotation (Placement(transformation(extent = {{-120, -50}, {-100, -30}})));
  Interfaces.RealOutput u "Command" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> u = u_c + (1 - t / T) (u_present - u_c)(0), 0 &lt;= t &lt;= T.</p>
<p><b>Source:</b> Astrom &amp; Hagglund, PID Controllers, 2nd ed. 1995, chapter 3.</p>
<p><b>Limitations:</b> see the classes that extend it.</p>
<p><b>Example:</b> <a href=\"modelica://HystFMU.Validation.BumplessTransfer\">Validation.BumplessTransfer</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Control.BumplessTransfer\">Control.BumplessTransfer</a>.</p>
</html>"));
end BumplessTransfer;
