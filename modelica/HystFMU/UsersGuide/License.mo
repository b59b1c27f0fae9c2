within HystFMU.UsersGuide;
package License "Licence"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>BSD 3-Clause. Copyright &copy; 2026, the HystFMU developers.</p>
<p>You may use, change and distribute the library, and models made with it, in source and binary form. The copyright
notice, the conditions and the disclaimer of the file LICENSE must be included. There is no warranty.</p>
</html>"));
end License;
