within HystFMU;
package UsersGuide "How to use the library"
  extends Icons.Information;
  annotation (Documentation(info = "<html>
<p>Getting started, realisations, conventions, tool support, references, release notes.</p>
</html>"));
end UsersGuide;
