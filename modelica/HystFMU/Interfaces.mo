within HystFMU;
package Interfaces "Ports and partial blocks"
  extends Icons.Package;

  connector RealInput = input Real "Input signal"
    annotation (
      Icon(graphics = {Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {0, 0, 127}, fillColor = {0, 0, 127}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Can be connected to every causal Real connector, also of the Modelica Standard Library.</p></html>"));

  connector RealOutput = output Real "Output signal"
    annotation (
      Icon(graphics = {Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {0, 0, 127}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Can be connected to every causal Real connector, also of the Modelica Standard Library.</p></html>"));

  connector Pin "Electrical pin"
    Types.Voltage v "Potential";
    flow Types.Current i "Current into the component";
    annotation (
      Icon(graphics = {Rectangle(extent = {{-100, -100}, {100, 100}}, lineColor = {0, 0, 255}, fillColor = {0, 0, 255}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>The same quantities as the pins of the Modelica Standard Library, with which it can be connected.</p></html>"));
  end Pin;

  connector Flange "Translational flange"
    Types.Position s "Position";
    flow Types.Force f "Force into the component";
    annotation (
      Icon(graphics = {Rectangle(extent = {{-100, -100}, {100, 100}}, lineColor = {0, 127, 0}, fillColor = {0, 127, 0}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>The same quantities as the flanges of Modelica.Mechanics.Translational, with which it can be connected.</p></html>"));
  end Flange;

  connector HeatPort "Thermal port"
    Types.Temperature T "Temperature";
    flow Types.Power Q_flow "Heat flow into the component";
    annotation (
      Icon(graphics = {Rectangle(extent = {{-100, -100}, {100, 100}}, lineColor = {191, 0, 0}, fillColor = {191, 0, 0}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>The same quantities as the heat ports of Modelica.Thermal.HeatTransfer, with which it can be connected.</p></html>"));
  end HeatPort;

  partial block Sampled "Block that acts at the start of the simulation and then every Ts"
    extends Icons.Sampled;
    parameter Types.Time Ts(min = 1e-12) = 1e-3 "Sample period: the communication step of the unit" annotation (Dialog(group = "Sampling"));
  protected
    parameter Types.Time t0(fixed = false) "Start of the simulation";
    Boolean begun(start = false, fixed = true) "False only before the first sample";
  initial equation
    t0 = time;
  equation
    when sample(t0, Ts) then
      begun = true;
    end when;
    annotation (Documentation(info = "<html>
<p>The block reads its inputs at t0 + k Ts, where t0 is any start time of the simulation, and holds its outputs until t0 + (k + 1) Ts. At t0 it is initialised. The block behaves like the unit of the same name with the step Ts.</p>
<p><b>Limitation:</b> blocks in series must have the same Ts; extrema of an input between two samples have no effect.</p>
</html>"));
  end Sampled;

  partial block Reversals "Block whose memory changes only at reversals of its input"
    extends Icons.Events;
    parameter Real eps(unit = "1/s", min = 0) = 1e-9 "Largest rate of the input that is treated as zero" annotation (Dialog(group = "Realisation"));
  protected
    RealInput rate(unit = "1/s") "Rate of the input, from the conditional port" annotation (Placement(transformation(extent = {{-90, -80}, {-70, -60}})));
    Boolean rising(start = true, fixed = true) "True if the input rises; a plateau does not change it";
  equation
    rising = rate > eps or (pre(rising) and not rate < -eps);
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> rising = rate &gt; eps or (pre(rising) and not rate &lt; -eps): there is one event per reversal and no event on a plateau. Between events, the output is a closed form of the input, exact for any step of the solver.</p>
<p><b>Limitation:</b> only the sign of the rate is used. If the input jumps, its rate does not show the reversal; replace a jump by a ramp. At a corner of the input, the stored extremum is the value at the event, which may be late by a rounding error of the time. Two reversals within one step of the solver are missed; rumoca 0.10.2 evaluates the rate only at output points.</p>
</html>"));
  end Reversals;

  partial block Rated "Block that needs the rate of its input"
    extends Icons.Smooth;
  protected
    RealInput rate(unit = "1/s") "Rate of the input, from the conditional port" annotation (Placement(transformation(extent = {{-90, -80}, {-70, -60}})));
    Real followed(start = 0, fixed = true) "Integral of the rate";
  equation
    // this state shows the solver the motion of the input while all plays rest
    der(followed) = rate;
    annotation (Documentation(info = "<html>
<p>The block is an ordinary differential equation without events; its input is the rate. A source, a state equation or Dynamics.RateFilter provides the rate. No input is differentiated.</p>
</html>"));
  end Rated;

  partial block InChain "Block whose states can start in equilibrium with the preceding block"
    extends Icons.Smooth;
    parameter Boolean inChain = false "True if the block follows an operator with events and no loop leads from y to u" annotation (Evaluate = true, Dialog(group = "Start"));
  protected
    Real first "Initial value of the states in a chain";
    discrete Real taken(start = 0, fixed = true) "Value at the start; 0 if the states have initial equations";
    Integer pass(start = 0, fixed = true) "Number of event iterations at the start";
    Boolean odd(start = false, fixed = true) "True if this number is odd";
  equation
    pass = if inChain then min(pre(pass) + 1, 8) else 0;
    odd = rem(pass, 2) > 0;
    when {initial(), odd, not odd} then
      taken = if inChain then first else 0;
    end when;
    annotation (Documentation(info = "<html>
<p>An initial equation computes the states in equilibrium from the initial input. rumoca 0.10.2 does not solve initial equations that depend on a discrete variable, such as the memory of an operator with events. With inChain = true, the states are relative to an initial value, which a when-equation assigns. All tools evaluate this when-equation at the initialisation.</p>
<p><b>Limitation:</b> in an event iteration, rumoca 0.10.2 uses the values of the previous iteration; eight iterations are enough for eight such blocks in series. In a loop, inChain = true causes an algebraic loop through a when-equation, which no tool solves.</p>
</html>"));
  end InChain;

  partial block Plant "Replaceable plant of a loop"
    extends Icons.Hysteresis;
    Interfaces.RealInput u "Command" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
    Interfaces.RealOutput y "Measured output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
    annotation (Documentation(info = "<html>
<p>Models that replace the plant of HystFMU.Loops.Tracking extend this class.</p>
</html>"));
  end Plant;

  partial block Inverse "Replaceable inverse of a loop: computes the command for a wanted output"
    extends Icons.Inverse;
    Interfaces.RealInput y "Wanted output" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
    Interfaces.RealOutput u "Input for the wanted output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
    annotation (Documentation(info = "<html>
<p>Models that replace the inverse of HystFMU.Loops.Tracking extend this class.</p>
</html>"));
  end Inverse;

  partial block Controller "Replaceable controller of a loop, with reference, measured output and feed-forward"
    extends Icons.Block;
    Interfaces.RealInput y_d "Reference" annotation (Placement(transformation(extent = {{-120, 43}, {-100, 63}})));
    Interfaces.RealInput y "Measured output of the plant" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
    Interfaces.RealInput u_ff "Feed-forward" annotation (Placement(transformation(extent = {{-120, -64}, {-100, -44}})));
    Interfaces.RealOutput u "Control" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
    annotation (Documentation(info = "<html>
<p>Models that replace the controller of HystFMU.Loops.Tracking extend this class.</p>
</html>"));
  end Controller;

  annotation (Documentation(info = "<html><p>Ports and base classes of the blocks.</p></html>"));
end Interfaces;
