within HystFMU.Inverse;
package Events "Inverses with one event for each reversal"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The memory changes only where the wanted output turns; the operators increase, so their input turns there, too, and the sign of the rate serves for both.</p>
</html>"));
end Events;
