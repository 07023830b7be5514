"""Work on pictures and frames: which files become which, reading, rendering and writing them, one or many. No command line in it."""
