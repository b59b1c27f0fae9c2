"""The face: content of `import hystfmu as hy`, thin calls of the rooms below; `dir(hystfmu)` lists it."""
