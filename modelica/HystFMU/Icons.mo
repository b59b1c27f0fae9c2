within HystFMU;
package Icons "Icons"
  extends Package;

  partial package Package "Icon of a package"
    annotation (
      Icon(graphics = {Rectangle(extent = {{-100, -100}, {100, 100}}, radius = 20, lineColor = {95, 95, 95}, fillColor = {235, 235, 235}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Icon of a package.</p></html>"));
  end Package;

  partial package Information "Icon of a page of the guide"
    annotation (
      Icon(graphics = {
        Ellipse(extent = {{-100, -100}, {100, 100}}, lineColor = {75, 138, 73}, fillColor = {75, 138, 73}, fillPattern = FillPattern.Solid),
        Text(extent = {{-60, -80}, {60, 80}}, lineColor = {255, 255, 255}, textString = "i")}),
      Documentation(info = "<html><p>Icon of a page of the guide.</p></html>"));
  end Information;

  partial block Frame "Frame of the icon of a block"
    annotation (
      Icon(graphics = {
        Rectangle(extent = {{-100, -100}, {100, 100}}, lineColor = {0, 0, 127}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid),
        Text(extent = {{-150, 140}, {150, 105}}, textString = "%name")}),
      Documentation(info = "<html><p>Frame of the icon of a block.</p></html>"));
  end Frame;

  partial block Block "Icon of a block: the name of its class"
    extends Frame;
    annotation (
      Icon(graphics = {Text(extent = {{-90, -30}, {90, 30}}, textString = "%class")}),
      Documentation(info = "<html><p>Icon of a block.</p></html>"));
  end Block;

  partial block Hysteresis "Icon of an operator with memory: a hysteresis loop"
    extends Frame;
    annotation (
      Icon(graphics = {Polygon(points = {{-70, -60}, {10, -50}, {70, 60}, {-10, 50}, {-70, -60}}, lineColor = {0, 0, 127}, smooth = Smooth.Bezier)}),
      Documentation(info = "<html><p>Icon of an operator with memory.</p></html>"));
  end Hysteresis;

  partial block Inverse "Icon of an inverse: a clockwise loop"
    extends Frame;
    annotation (
      Icon(graphics = {
        Polygon(points = {{-60, -70}, {-50, 10}, {60, 70}, {50, -10}, {-60, -70}}, lineColor = {0, 0, 127}, smooth = Smooth.Bezier),
        Text(extent = {{20, -60}, {95, -95}}, textString = "-1")}),
      Documentation(info = "<html><p>Icon of an inverse.</p></html>"));
  end Inverse;

  partial block Sampled "Badge of a block that acts at the instants k Ts"
    annotation (
      Icon(graphics = {Line(points = {{-90, -80}, {-75, -80}, {-75, -70}, {-60, -70}, {-60, -60}}, color = {217, 67, 180})}),
      Documentation(info = "<html><p>Badge of a block that acts at the instants k Ts.</p></html>"));
  end Sampled;

  partial block Events "Badge of a block with one event for each reversal"
    annotation (
      Icon(graphics = {Line(points = {{-90, -80}, {-75, -60}, {-60, -80}}, color = {217, 67, 180})}),
      Documentation(info = "<html><p>Badge of a block with one event for each reversal.</p></html>"));
  end Events;

  partial block Smooth "Badge of a block without events"
    annotation (
      Icon(graphics = {Line(points = {{-90, -80}, {-80, -78}, {-70, -62}, {-60, -60}}, color = {217, 67, 180}, smooth = Smooth.Bezier)}),
      Documentation(info = "<html><p>Badge of a block without events.</p></html>"));
  end Smooth;

  partial block Source "Icon of a source"
    extends Frame;
    annotation (
      Icon(graphics = {Line(points = {{-80, 0}, {-40, 60}, {0, 0}, {40, -60}, {80, 0}}, color = {0, 0, 127}, smooth = Smooth.Bezier)}),
      Documentation(info = "<html><p>Icon of a source.</p></html>"));
  end Source;

  partial record Record "Icon of a record"
    annotation (
      Icon(graphics = {Rectangle(extent = {{-100, -60}, {100, 60}}, lineColor = {64, 64, 64}, fillColor = {255, 215, 136}, fillPattern = FillPattern.Solid), Line(points = {{-100, 0}, {100, 0}}, color = {64, 64, 64}), Text(extent = {{-150, 105}, {150, 70}}, textString = "%name")}),
      Documentation(info = "<html><p>Icon of a record.</p></html>"));
  end Record;

  partial function Function "Icon of a function"
    annotation (
      Icon(graphics = {Ellipse(extent = {{-100, -100}, {100, 100}}, lineColor = {108, 88, 49}, fillColor = {255, 215, 136}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Icon of a function.</p></html>"));
  end Function;

  partial model Component "Icon of a physical component"
    annotation (
      Icon(graphics = {
        Rectangle(extent = {{-80, -60}, {80, 60}}, lineColor = {64, 64, 64}, fillColor = {215, 215, 215}, fillPattern = FillPattern.Solid),
        Text(extent = {{-150, 110}, {150, 75}}, textString = "%name")}),
      Documentation(info = "<html><p>Icon of a physical component.</p></html>"));
  end Component;

  partial model Example "Icon of a model that can be simulated"
    annotation (
      Icon(graphics = {Polygon(points = {{-60, -80}, {80, 0}, {-60, 80}, {-60, -80}}, lineColor = {75, 138, 73}, fillColor = {75, 138, 73}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Icon of a model that can be simulated.</p></html>"));
  end Example;

  annotation (Documentation(info = "<html><p>Icons of the library's classes.</p></html>"));
end Icons;
