within HystFMU.Operators;
package Events "Operators with one event for each reversal"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>The memory changes only where the input turns; in between the output is a closed form of the input. They need the rate of the input, of which only the sign is used: <code>rising = du &gt; eps or (pre(rising) and not du &lt; -eps)</code>.</p>
</html>"));
end Events;
