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

  partial block Sampled "Block that acts at the instants 0, Ts, 2 Ts, ..."
    extends Icons.Block;
    parameter Types.Time Ts(min = 1e-12) = 1e-3 "Sample period: the communication step of the unit";
    annotation (Documentation(info = "<html>
<p>Inputs are read at k Ts; outputs are held until (k + 1) Ts. The instant 0 is the initialisation.</p>
<p><b>Limitation:</b> blocks in one chain must have the same Ts.</p>
</html>"));
  end Sampled;

  annotation (Documentation(info = "<html><p>Ports of the blocks, and what sampled blocks have in common.</p></html>"));
end Interfaces;
