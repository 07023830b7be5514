"""The variant of the shadow-map article: 600 steps of 0.8 m through the cascades of a sun."""
