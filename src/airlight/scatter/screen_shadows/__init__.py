"""Screen-space shadows in the air: what the depth of the picture itself hides of a light that is seen in it."""
