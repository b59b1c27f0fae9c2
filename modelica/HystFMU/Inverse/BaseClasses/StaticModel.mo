within HystFMU.Inverse.BaseClasses;
partial package StaticModel "Static model as one function, which an implicit inverse evaluates and then steps"
  extends Icons.Package;

  replaceable partial function step "State of the model after a new input; its first element is the output"
    extends Icons.Function;
    input Real u "New input";
    input Real state[:] "Last output and memory";
    input Real values[:] "Parameters of the model";
    output Real state_new[size(state, 1)] "New output and memory";
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> equation of the model; state_new[1] is its output at u.</p>
<p><b>Source:</b> as for the model.</p>
<p><b>Limitations:</b> the model must depend only on u and its past, not on the time, and have no dynamics.</p>
</html>"));
  end step;

  function deviation "Output at the input u minus wanted output"
    extends Icons.Function;
    input Real u "Trial input";
    input Real wanted "Wanted output";
    input Real state[:] "Last output and memory of the model";
    input Real values[:] "Parameters of the model";
    output Real f "Output minus wanted output";
  protected
    Real after[size(state, 1)] = step(u, state, values);
  algorithm
    f := after[1] - wanted;
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> f(u) = h(u) - y.</p>
<p><b>Source:</b> definition.</p>
<p><b>Limitations:</b> as for the model.</p>
</html>"));
  end deviation;

  function between "Root of the deviation between two inputs with deviations of opposite sign"
    extends Icons.Function;
    input Real a_first "First end of the bracket";
    input Real b_first "Second end of the bracket";
    input Real fa_first "Deviation at a_first";
    input Real fb_first "Deviation at b_first, with the opposite sign";
    input Real fine "Absolute part of the tolerance";
    input Real wanted "Wanted output";
    input Real state[:] "Last output and memory of the model";
    input Real values[:] "Parameters of the model";
    output Real u "Input at which the model has the wanted output";
  protected
    constant Integer most = 120 "Largest number of steps: twice the number of halvings from any range to the last bit";
    Real a = a_first "Newest point";
    Real b = b_first "Other end of the bracket";
    Real c "Point that left the bracket";
    Real fa = fa_first "Deviation at a";
    Real fb = fb_first "Deviation at b";
    Real fc "Deviation at c";
    Real x "Trial point";
    Real fx "Deviation at x";
    Real t = fa_first/(fa_first - fb_first) "Relative position of x between a and b";
    Real least "Smallest step, relative to the bracket";
    Real xi "Relative position of a between c and b";
    Real phi "Relative position of fa between fc and fb";
    Boolean found = false "True if the bracket is small enough";
  algorithm
    u := a;
    for i in 1:most loop
      if not found then
        x := a + (if t > 0 and t < 1 then t else 0.5)*(b - a);
        fx := deviation(x, wanted, state, values);
        if fx < 0 and fa > 0 or fx > 0 and fa < 0 then
          c := b;
          fc := fb;
          b := a;
          fb := fa;
        else
          c := a;
          fc := fa;
        end if;
        a := x;
        fa := fx;
        u := if abs(fa) < abs(fb) then a else b;
        least := if abs(b - a) > 0 then (4.5e-16*abs(u) + fine)/abs(b - a) else 1;
        if min(abs(fa), abs(fb)) <= 0 or least >= 0.5 then
          found := true;
        else
          t := 0.5;
          xi := (a - b)/(c - b);
          // equal deviations at b and c: no parabola
          phi := if abs(fc - fb) > 0 then (fa - fb)/(fc - fb) else 2;
          if phi^2 < xi and (1 - phi)^2 < 1 - xi then
            t := fa/(fb - fa)*fc/(fb - fc) + (c - a)/(b - a)*fa/(fc - fa)*fb/(fc - fb);
          end if;
          t := min(max(t, least), 1 - least);
        end if;
      end if;
    end for;
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> inverse quadratic interpolation if it is safe, otherwise bisection.</p>
<p><b>Source:</b> Chandrupatla, Advances in Engineering Software 28 (1997) 145-149.</p>
<p><b>Limitations:</b> the loop has a fixed length, because rumoca 0.10.2 supports no while loop whose end depends on
data.</p>
</html>"));
  end between;

  function root "Input in [lo, hi] at which the model has the wanted output, the nearest input if there are several"
    extends Icons.Function;
    input Real wanted "Wanted output";
    input Real lo "Lower limit of the input";
    input Real hi "Upper limit of the input";
    input Real last "Last input";
    input Real state[:] "Last output and memory of the model";
    input Real values[:] "Parameters of the model";
    output Real u "Input";
  protected
    Real centre = min(max(last, lo), hi);
    Real f_centre = deviation(centre, wanted, state, values);
    Real rise = if f_centre < 0 then 1 else -1 "Direction in which an increasing output approaches the wanted output";
    Real near[2] = {centre, centre} "Ends of the searched range";
    Real f_near[2] = {f_centre, f_centre} "Deviations at the ends of the searched range";
    Real radius = (hi - lo)/1024;
    Real best = centre "Searched point with the smallest deviation";
    Real f_best = abs(f_centre);
    Real next "End of the next ring";
    Real f_next;
    Boolean found = abs(f_centre) <= 0;
  algorithm
    u := centre;
    for ring in 0:10 loop
      for side in 1:2 loop
        if not found then
          next := min(max(centre + (if side == 1 then rise else -rise)*radius, lo), hi);
          if abs(next - near[side]) > 0 then
            f_next := deviation(next, wanted, state, values);
            if abs(f_next) <= 0 then
              u := next;
              found := true;
            elseif f_next < 0 and f_near[side] > 0 or f_next > 0 and f_near[side] < 0 then
              u := between(near[side], next, f_near[side], f_next, 1e-16*(hi - lo), wanted, state, values);
              found := true;
            else
              if abs(f_next) < f_best then
                best := next;
                f_best := abs(f_next);
              end if;
              near[side] := next;
              f_near[side] := f_next;
            end if;
          end if;
        end if;
      end for;
      radius := 2*radius;
    end for;
    if not found then
      // both ends are bounds now; for equal deviations, use the upper bound if the output is too low
      u := if f_best < min(abs(f_near[1]), abs(f_near[2])) then best elseif abs(f_near[2]) < abs(f_near[1]) then near[2] else near[1];
    end if;
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> the function searches rings around the last input for a change of sign of h(u) - y. The radius
doubles from 1/1024 of the range; in each ring, the function first searches the side on which an increasing output
approaches y. The first change of sign encloses the root. Without a change of sign, the result is the bound or searched
point with the smallest deviation.</p>
<p><b>Source:</b> the rule of the unit implicit_inverse.</p>
<p><b>Limitations:</b> two roots within one ring can be missed.</p>
</html>"));
  end root;

  annotation (Documentation(info = "<html>
<p>Your own model extends this package with <code>redeclare function extends step</code>. The function root then works
without further code. A sum or series of operators calls the functions step of their packages in Inverse.Models, each
with its part of state and values.</p>
<p><b>See also:</b> <a href=\"modelica://HystFMU.Inverse.Sampled.ImplicitInverse\">Inverse.Sampled.ImplicitInverse</a>, <a href=\"modelica://HystFMU.Inverse.Models\">Inverse.Models</a>.</p>
</html>"));
end StaticModel;
