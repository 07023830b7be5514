"""Light that a medium scatters once, summed along each ray through shadow maps: texel by texel, or in steps."""
