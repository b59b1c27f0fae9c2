within HystFMU.Functions;
function boucWen "Hysteretic part of the Bouc-Wen operator after a new input"
  extends Icons.Function;
  input Real u "New input";
  input Real u_last "Input before";
  input Real z_last "Hysteretic part there";
  input Real A "Slope of z at z = 0";
  input Real beta "Width of the loop";
  input Real gamma "Shape of the loop";
  input Real n "Sharpness of the knee";
  input Integer steps = 20 "Runge-Kutta steps, for n other than 1";
  output Real z "Hysteretic part at u";
protected
  Real direction = if u >= u_last then 1 else -1;
  Real way = abs(u - u_last) "Way that is left";
  Real v = direction*z_last "It grows along the way";
  Real to_zero "Way to v = 0";
  Real c = gamma - beta;
  Real h;
  Real k_1;
  Real k_2;
  Real k_3;
  Real k_4;
algorithm
  if n == 1 then
    // dv/dxi = A + c v up to v = 0, then A - (gamma + beta) v
    if v < 0 then
      to_zero := if c == 0 then -v/A else log(A/(A + c*v))/c;
      if to_zero > way then
        v := if c == 0 then v + A*way else (v + A/c)*exp(c*way) - A/c;
        way := 0;
      else
        v := 0;
        way := way - to_zero;
      end if;
    end if;
    if v >= 0 then
      v := A/(gamma + beta) + (v - A/(gamma + beta))*exp(-(gamma + beta)*way);
    end if;
  else
    h := way/steps;
    for i in 1:steps loop
      k_1 := boucWenSlope(v, A, beta, gamma, n);
      k_2 := boucWenSlope(v + 0.5*h*k_1, A, beta, gamma, n);
      k_3 := boucWenSlope(v + 0.5*h*k_2, A, beta, gamma, n);
      k_4 := boucWenSlope(v + h*k_3, A, beta, gamma, n);
      v := v + h/6*(k_1 + 2*(k_2 + k_3) + k_4);
    end for;
  end if;
  z := direction*v;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> with v = z sgn(u'), xi = abs(u - u_last): dv/dxi = A - c(v) abs(v)<sup>n</sup>, c = gamma + beta for v &gt; 0, gamma - beta for v &lt; 0.</p>
<p><b>Source:</b> Wen, J. Eng. Mech. Div. 102 (1976) 249-263; Ikhouane &amp; Rodellar, Systems with Hysteresis, 2007, chapter 2.</p>
<p><b>Limitations:</b> closed form for n = 1; otherwise a fixed number of Runge-Kutta steps, whose error grows with the size of the input step.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.BoucWen\">Operators.Events.BoucWen</a>, <a href=\"modelica://HystFMU.Operators.Sampled.BoucWen\">Operators.Sampled.BoucWen</a>, which use it.</p>
</html>"));
end boucWen;
