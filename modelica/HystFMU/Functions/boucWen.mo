within HystFMU.Functions;
function boucWen "Hysteretic part of the Bouc-Wen operator after a new input"
  extends Icons.Function;
  input Real u "New input";
  input Real u_last "Last input";
  input Real z_last "Hysteretic part at the last input";
  input Real A "Slope of z at z = 0";
  input Real beta "Width of the loop";
  input Real gamma "Shape of the loop";
  input Real n "Sharpness of the knee";
  output Real z "Hysteretic part at u";
protected
  Real direction = if u >= u_last then 1 else -1;
  Real way = abs(u - u_last) "Remaining path of the input";
  Real v = direction*z_last "z in the direction of the input, increasing along the path";
  Real to_zero = abs(v)/A "Path to v = 0";
  Boolean straight = abs(gamma - beta)*abs(v)^n < 1e-17*A "True if the path to v = 0 is straight";
  Real c = gamma - beta;
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
    if v < 0 then
      if not straight then
        to_zero := boucWenWay(-v, A, c, n);
      end if;
      if to_zero <= way then
        v := 0;
        way := way - to_zero;
      elseif straight then
        v := v + A*way;
      elseif A - c*abs(v)^n > 0 then
        // otherwise beta = 0 and z stays at its bound
        v := -boucWenReach(to_zero - way, A, c, n);
      end if;
    end if;
    if v >= 0 then
      v := boucWenReach(boucWenWay(v, A, gamma + beta, n) + way, A, gamma + beta, n);
    end if;
  end if;
  z := direction*v;
  annotation (smoothOrder = 0, Documentation(info = "<html>
<p><b>Equation:</b> with v = z sgn(u'), xi = abs(u - u_last): dv/dxi = A - c(v) abs(v)<sup>n</sup>, c = gamma + beta for v &gt; 0, gamma - beta for v &lt; 0.</p>
<p><b>Source:</b> Wen, J. Eng. Mech. Div. 102 (1976) 249-263; Ikhouane &amp; Rodellar, Systems with Hysteresis, 2007, chapter 2.</p>
<p><b>Limitations:</b> the result has a closed form for n = 1, otherwise it uses an incomplete beta function and its inverse. It has only rounding errors for any size of the input step.</p>
<p><b>Example:</b> <code>boucWen(u, pre(u_last), pre(z), A, beta, gamma, n)</code> in <a href=\"modelica://HystFMU.Operators.Sampled.BoucWen\">Operators.Sampled.BoucWen</a>.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Events.BoucWen\">Operators.Events.BoucWen</a>, <a href=\"modelica://HystFMU.Operators.Sampled.BoucWen\">Operators.Sampled.BoucWen</a>, which use it.</p>
</html>"));
end boucWen;
