"""The public Python interface, `import hystfmu as hy`. `dir(hystfmu)` lists the public names."""
