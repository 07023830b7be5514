"""Shadow-mapped in-scattering of the shadow-map article (unpublished, 2014): as its code has it, and as its prose has it."""
