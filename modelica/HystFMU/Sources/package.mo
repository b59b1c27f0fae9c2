within HystFMU;
package Sources "Signal sources"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Continuous reference signals with the derivatives for a feed-forward.</p>
</html>"));
end Sources;
