"""The public interface, `import hystfmu as hy`: thin calls of the other packages; `dir(hystfmu)` lists it."""
