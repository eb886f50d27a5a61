"""Clouds: what the scanner would bring home from each station, simulated beam by beam, for point-cloud tools."""
