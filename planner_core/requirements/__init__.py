"""Requirements: what a client asks, read from files, turned into targets of selection, and explained."""
