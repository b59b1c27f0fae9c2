within HystFMU.UsersGuide;
package License "Licence"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>BSD 3-Clause. Copyright &copy; 2026, the HystFMU developers.</p>
<p>You may use, change and pass on the library, and models that are made with it, in source and binary form, as long as the copyright notice, the conditions and the
disclaimer of the file LICENSE stay with it. It comes without any warranty.</p>
</html>"));
end License;
