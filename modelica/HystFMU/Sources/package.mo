within HystFMU;
package Sources "Signal sources"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Continuous reference signals with the derivatives that a feed-forward needs.</p>
</html>"));
end Sources;
