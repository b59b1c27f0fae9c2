within HystFMU.UsersGuide;
package Contact "Contact"
  extends Icons.Information;
  annotation (preferredView = "info", DocumentationClass = true, Documentation(info = "<html>
<p>Report questions, faults and wishes as issues of the HystFMU project. State the model, the tool with its version, and the messages of the tool.</p>
<p>The HystFMU developers.</p>
</html>"));
end Contact;
