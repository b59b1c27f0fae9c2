"""The public interface, `import hystfmu as hy`. It calls the other packages; `dir(hystfmu)` lists its names."""
