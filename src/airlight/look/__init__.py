"""The look: shafts that a photographer keeps. See docs/look.md for the recipe; reference/look.py has the float64 twins of the shaders."""
