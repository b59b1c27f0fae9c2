within HystFMU;
package Icons "Icons"

  partial package Package "Icon of a package"
    annotation (
      Icon(graphics = {Rectangle(extent = {{-100, -100}, {100, 100}}, radius = 20, lineColor = {95, 95, 95}, fillColor = {235, 235, 235}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Icon of a package.</p></html>"));
  end Package;

  partial block Block "Icon of a block: a hysteresis loop"
    annotation (
      Icon(graphics = {
        Rectangle(extent = {{-100, -100}, {100, 100}}, lineColor = {0, 0, 127}, fillColor = {255, 255, 255}, fillPattern = FillPattern.Solid),
        Polygon(points = {{-70, -60}, {10, -50}, {70, 60}, {-10, 50}, {-70, -60}}, lineColor = {0, 0, 127}, smooth = Smooth.Bezier),
        Text(extent = {{-150, 140}, {150, 105}}, textString = "%name")}),
      Documentation(info = "<html><p>Icon of a block.</p></html>"));
  end Block;

  partial function Function "Icon of a function"
    annotation (
      Icon(graphics = {Ellipse(extent = {{-100, -100}, {100, 100}}, lineColor = {108, 88, 49}, fillColor = {255, 215, 136}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Icon of a function.</p></html>"));
  end Function;

  partial model Example "Icon of a model that can be simulated"
    annotation (
      Icon(graphics = {Polygon(points = {{-60, -80}, {80, 0}, {-60, 80}, {-60, -80}}, lineColor = {75, 138, 73}, fillColor = {75, 138, 73}, fillPattern = FillPattern.Solid)}),
      Documentation(info = "<html><p>Icon of a model that can be simulated.</p></html>"));
  end Example;

  annotation (Documentation(info = "<html><p>Icons of the library's classes.</p></html>"));
end Icons;
