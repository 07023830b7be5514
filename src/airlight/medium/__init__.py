"""Media that scatter light: their coefficients in `resolve`, their shaders beside it."""
