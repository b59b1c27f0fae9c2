// generated from scenarios/models/backlash_identified.model.toml - do not edit
within HystFMU.Data;
record BacklashIdentified "Prandtl-Ishlinskii operator with a scaled output, identified from data"
  parameter Integer n = 20 "Number of play operators";
  parameter Real w0 = 0.3088706033693739 "Weight of the linear term";
  parameter Real r[n] = {0.05989109563397841, 0.11978219126795682, 0.17967328690193524, 0.23956438253591364, 0.29945547816989204, 0.3593465738038705, 0.4192376694378489, 0.4791287650718273, 0.5390198607058057, 0.5989109563397841, 0.6588020519737625, 0.718693147607741, 0.7785842432417193, 0.8384753388756978, 0.8983664345096761, 0.9582575301436546, 1.018148625777633, 1.0780397214116113, 1.1379308170455897, 1.1978219126795682} "Thresholds (play half-widths), increasing";
  parameter Real w[n] = {0.11655401557696973, 0.1291481768957168, 0.10664087174699648, 0.14937117851918683, 0.07878781637558424, 0.1530794726348845, 0.09366686104887942, 0.14350835404441312, 0.019503845207384657, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0019206314455982533, 0.0003392615932798156, 0.0, 0.006528541885481392} "Weights of the plays";
  parameter Real u0 = 0.0 "Initial memory: every play rests at this value";
  parameter Real gain = 1.0 "Factor of the output";
  parameter Real offset = -0.00015225695681838836 "Added to the output";
  annotation (Documentation(info = "<html>
<p><b>Equation:</b> y = offset + gain (w0 u + sum_i w_i p_{r_i}[u]).</p>
<p><b>Source:</b> scenarios/models/backlash_identified.model.toml: fit, data and options stand there.</p>
<p><b>Limitation:</b> valid within the range of the identification data.</p>
</html>"));
end BacklashIdentified;
