"""`airlight compare`: methods or settings side by side, with error, cost and a difference picture."""
