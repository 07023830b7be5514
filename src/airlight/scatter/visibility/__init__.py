"""The table of visibility: what share of the light reaches each ray of the eye, up to each distance, summed once for all pixels."""
