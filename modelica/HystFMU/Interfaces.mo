within HystFMU;
package Interfaces "Ports and partial blocks"
  extends Icons.Package;

  connector RealInput = input Real "Input signal"
    annotation (
      Icon(graphics = {Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {0, 0, 127}, fillColor = {0, 0, 127}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Connects to every causal Real connector, those of the Modelica Standard Library included.</p></html>"));

  connector RealOutput = output Real "Output signal"
    annotation (
      Icon(graphics = {Polygon(points = {{-100, 100}, {100, 0}, {-100, -100}}, lineColor = {0, 0, 127}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Connects to every causal Real connector, those of the Modelica Standard Library included.</p></html>"));

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

  partial block Sampled "Block that acts at the start of the simulation and every Ts from there"
    extends Icons.Sampled;
    parameter Types.Time Ts(min = 1e-12) = 1e-3 "Sample period: the communication step of the unit" annotation (Dialog(group = "Sampling"));
  protected
    parameter Types.Time t0(fixed = false) "Start of the simulation";
    Boolean begun(start = false, fixed = true) "Has a sample been taken? pre(begun) is false at the first one alone";
  initial equation
    t0 = time;
  equation
    when sample(t0, Ts) then
      begun = true;
    end when;
    annotation (Documentation(info = "<html>
<p>Inputs are read at t0 + k Ts, t0 the start of the simulation, whatever it is; outputs are held until t0 + (k + 1) Ts. The instant t0 is the initialisation. The block is the unit of the same name stepped with Ts.</p>
<p><b>Limitation:</b> blocks in one chain must have the same Ts; extrema of an input between two samples are not seen.</p>
</html>"));
  end Sampled;

  partial block Reversals "Block whose memory changes where its input turns, and there only"
    extends Icons.Events;
    parameter Real eps(unit = "1/s", min = 0) = 1e-9 "Rate of the input that is not yet a reversal" annotation (Dialog(group = "Realisation"));
  protected
    RealInput rate(unit = "1/s") "Rate of the input; connected to the conditional port" annotation (Placement(transformation(extent = {{-90, -80}, {-70, -60}})));
    Boolean rising(start = true, fixed = true) "Direction of the input; a plateau keeps it";
  equation
    rising = rate > eps or (pre(rising) and not rate < -eps);
    annotation (Documentation(info = "<html>
<p><b>Equation:</b> rising = rate &gt; eps or (pre(rising) and not rate &lt; -eps): one event for each reversal, none on a plateau. In between, the output is a closed form of the input: exact whatever the solver's step.</p>
<p><b>Limitation:</b> only the sign of the rate is used. An input that jumps does not show its reversal in its rate: a jump must be a ramp. At a corner of the input the turning point is its value at the event, which a tool may place a rounding error of the time late. Two reversals within one step of the solver go unseen: rumoca 0.10.2 looks at the rate at the output interval.</p>
</html>"));
  end Reversals;

  partial block Rated "Block that needs the rate of its input"
    extends Icons.Smooth;
  protected
    RealInput rate(unit = "1/s") "Rate of the input; connected to the conditional port" annotation (Placement(transformation(extent = {{-90, -80}, {-70, -60}})));
    Real followed(start = 0, fixed = true) "Integral of the rate";
  equation
    // while every play rests, nothing else tells the solver that the input moves: it would step over the next motion
    der(followed) = rate;
    annotation (Documentation(info = "<html>
<p>An ordinary differential equation without events, driven by the rate of its input. The rate comes from a source, from a state equation, or from Dynamics.RateFilter; no input is differentiated.</p>
</html>"));
  end Rated;

  partial block InChain "Block with states that can start from what stands in front of it"
    extends Icons.Smooth;
    parameter Boolean inChain = false "Behind an operator with events, and no loop leads from y back to u" annotation (Evaluate = true, Dialog(group = "Start"));
  protected
    Real first "From what the states start in a chain";
    discrete Real taken(start = 0, fixed = true) "Its value at the start; 0 where the states have initial equations";
    Integer pass(start = 0, fixed = true) "Passes of the event iteration at the start";
    Boolean odd(start = false, fixed = true) "Is their number odd?";
  equation
    pass = if inChain then min(pre(pass) + 1, 8) else 0;
    odd = rem(pass, 2) > 0;
    when {initial(), odd, not odd} then
      taken = if inChain then first else 0;
    end when;
    annotation (Documentation(info = "<html>
<p>The states of a block in equilibrium follow from its input at the start: an initial equation. rumoca 0.10.2 solves none that depends on a discrete variable, such as the memory of an operator with events. With inChain the states are counted from what was taken at the start, by a when-equation with an assignment, which every tool has among its initial equations.</p>
<p><b>Limitation:</b> rumoca 0.10.2 takes the values of a pass from the one before: eight passes serve eight such blocks one after the other. In a loop, inChain makes an algebraic loop through a when-equation, which no tool solves.</p>
</html>"));
  end InChain;

  partial block Plant "Slot of a loop: what is controlled"
    extends Icons.Hysteresis;
    Interfaces.RealInput u "Command" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
    Interfaces.RealOutput y "Measured output" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
    annotation (Documentation(info = "<html>
<p>What stands in the slot plant of HystFMU.Loops.Tracking extends this class.</p>
</html>"));
  end Plant;

  partial block Inverse "Slot of a loop: the command that gives a wanted output"
    extends Icons.Inverse;
    Interfaces.RealInput y "Wanted output" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
    Interfaces.RealOutput u "Input that gives it" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
    annotation (Documentation(info = "<html>
<p>What stands in the slot inverse of HystFMU.Loops.Tracking extends this class.</p>
</html>"));
  end Inverse;

  partial block Controller "Slot of a loop: control from reference, measured output and feed-forward"
    extends Icons.Block;
    Interfaces.RealInput y_d "Reference" annotation (Placement(transformation(extent = {{-120, 43}, {-100, 63}})));
    Interfaces.RealInput y "Measured output of the plant" annotation (Placement(transformation(extent = {{-120, -10}, {-100, 10}})));
    Interfaces.RealInput u_ff "Feed-forward" annotation (Placement(transformation(extent = {{-120, -64}, {-100, -44}})));
    Interfaces.RealOutput u "Control" annotation (Placement(transformation(extent = {{100, -10}, {120, 10}})));
    annotation (Documentation(info = "<html>
<p>What stands in the slot controller of HystFMU.Loops.Tracking extends this class.</p>
</html>"));
  end Controller;

  annotation (Documentation(info = "<html><p>Ports of the blocks, and what sampled blocks have in common.</p></html>"));
end Interfaces;
