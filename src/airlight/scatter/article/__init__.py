"""Shadow-mapped in-scattering of an unpublished article (2014): as its code has it, and as its prose has it."""
