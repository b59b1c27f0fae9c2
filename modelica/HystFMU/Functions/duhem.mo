within HystFMU.Functions;
function duhem "State of the Duhem operator after a new input of one direction"
  extends Icons.Function;
  input Real u "New input";
  input Real u_last "Input before";
  input Real w_last "State there";
  input Real a[:] "Coefficients of the direction";
  input Real b[:] "Coefficients";
  input Real c[:] "Coefficients";
  input Integer q "Degree in w";
  input Real w_max "Bound of abs(w)";
  input Real du_max "Longest step";
  input Integer steps "Most steps";
  output Real w "State at u";
protected
  Real m = min(floor(abs(u - u_last)/du_max) + 1, steps) "Number of steps";
  Real h = (u - u_last)/m "Step";
  Real at "Input at the begin of a step";
  Real next "State after it";
  Real way "Way to w = 0";
  Real k_1;
  Real k_2;
  Real k_3;
  Real k_4;
algorithm
  w := w_last;
  at := u_last;
  for i in 1:steps loop
    if i <= m then
      next := duhemStep(at, w, h, a, b, c, q);
      if w*next < 0 then
        // the corner of abs(w): a step of du/dw to w = 0, then the rest
        k_1 := 1/duhemSlope(at, w, a, b, c, q);
        k_2 := 1/duhemSlope(at - 0.5*w*k_1, 0.5*w, a, b, c, q);
        k_3 := 1/duhemSlope(at - 0.5*w*k_2, 0.5*w, a, b, c, q);
        k_4 := 1/duhemSlope(at - w*k_3, 0, a, b, c, q);
        way := -w/6*(k_1 + 2*(k_2 + k_3) + k_4);
        if way*h > 0 and abs(way) < abs(h) then
          next := duhemStep(at + way, 0, h - way, a, b, c, q);
        end if;
      end if;
      w := min(max(next, -w_max), w_max);
      at := u_last + i*h;
    end if;
  end for;
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> integral of dw/du from u_last to u in at most <em>steps</em> Runge-Kutta steps, cut at w = 0.</p>
<p><b>Source:</b> Oh &amp; Bernstein 2005; the cut keeps the order at the corner of abs(w).</p>
<p><b>Limitations:</b> u and u_last on one branch: the input must not have turned between them.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Operators.Sampled.Duhem\">Operators.Sampled.Duhem</a>, which uses it.</p>
</html>"));
end duhem;
