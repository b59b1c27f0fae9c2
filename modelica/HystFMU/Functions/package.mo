within HystFMU;
package Functions "Functions of the blocks"
  extends Icons.Package;
  annotation (Documentation(info = "<html>
<p>These functions compute the steps of the blocks. They are pure functions of arrays: new memory = f(input, old memory).</p>
</html>"));
end Functions;
