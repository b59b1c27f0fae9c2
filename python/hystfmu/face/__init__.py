"""The face: what `import hystfmu as hy` offers, thin calls of the rooms below; `dir(hystfmu)` lists it."""
