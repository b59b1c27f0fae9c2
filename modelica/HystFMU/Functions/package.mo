within HystFMU;
package Functions "Functions behind the blocks"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>Everything that a block computes with its memory, as pure functions of arrays: new memory = f(input, old memory).</p>
</html>"));
end Functions;
