within HystFMU.Functions;
function jilesAthertonOutput "Magnetisation of the Jiles-Atherton operator"
  extends Icons.Function;
  input Real u "Field";
  input Real m "Irreversible part of the magnetisation";
  input Real Ms "Saturation";
  input Real a "Shape";
  input Real c "Reversible share";
  input Real alpha "Mean field for a magnetisation of 1";
  output Real y "Magnetisation";
algorithm
  y := (1 - c)*m + c*Ms*langevin(jilesAthertonField(u, m, Ms, a, c, alpha)/a);
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> y = (1 - c) m + c Ms L(h/a), h = u + alpha y.</p>
<p><b>Source:</b> Jiles &amp; Atherton, J. Magn. Magn. Mater. 61 (1986) 48-60.</p>
<p><b>Limitations:</b> alpha Ms &lt; 3 a.</p>
<p><b>Example:</b> <code>jilesAthertonOutput(u, m_last, Ms, a, c, alpha)</code> in <a href=\"modelica://HystFMU.Operators.Sampled.JilesAtherton\">Operators.Sampled.JilesAtherton</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.JilesAtherton\">Operators.Sampled.JilesAtherton</a>, <a href=\"modelica://HystFMU.Operators.Smooth.JilesAtherton\">Operators.Smooth.JilesAtherton</a>, which use it.</p>
</html>"));
end jilesAthertonOutput;
