within HystFMU.Functions;
function boucWenSlope "Slope of the hysteretic part along the way of the input"
  extends Icons.Function;
  input Real v "Hysteretic part times the direction";
  input Real A "Slope at v = 0";
  input Real beta "Width of the loop";
  input Real gamma "Shape of the loop";
  input Real n "Sharpness of the knee";
  output Real slope "dv/dxi";
algorithm
  slope := A - (if v >= 0 then gamma + beta else gamma - beta)*abs(v)^n;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> dv/dxi = A - (gamma + beta sgn(v)) abs(v)<sup>n</sup>.</p>
<p><b>Source:</b> Wen, J. Eng. Mech. Div. 102 (1976) 249-263.</p>
<p><b>Limitations:</b> n &ge; 1.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Functions.boucWen\">Functions.boucWen</a>, which uses it.</p>
</html>"));
end boucWenSlope;
