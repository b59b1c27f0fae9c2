within HystFMU;
package UsersGuide "User's guide"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>Getting started, realisations, conventions, checks, tool support, references, release notes, contact, licence.</p>
</html>"));
end UsersGuide;
