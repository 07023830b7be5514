"""The live viewer: a picture or a 3-D scene with its shafts, and a panel of their parameters, on any canvas of rendercanvas."""
