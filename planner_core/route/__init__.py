"""Route: in which order stations are visited, along which way, and how long it takes."""
