within HystFMU;
package UsersGuide "How to use the library"
  annotation (Documentation(info = "<html>
<p><b>Sampled blocks.</b> Operators, inverses and controllers act at 0, Ts, 2 Ts, ... and hold their outputs in between. Blocks in
a chain must have the same Ts. A loop needs a block without direct feed-through in it: a transfer function whose numerator has
a lower degree than its denominator, or a delay.</p>
<p><b>The same model as a unit.</b> A class carries the names, units and defaults of the HystFMU unit of the same name. A unit that
is stepped with the communication step Ts gives the values that the class has just after each sample. Linear dynamics are continuous
here and discretised exactly in the unit; their values just before the next sample are those of the unit for the input held
over the step.</p>
<p><b>Memory.</b> The parameter depth is the number of extrema that an operator remembers. The default is that of the unit; a small
one (16) makes simulation much faster and is enough unless loops are nested more deeply.</p>
<p><b>Identified models.</b> Records in Data are generated from model files; see Examples.SlidingMode for their use.</p>
</html>"));
end UsersGuide;
