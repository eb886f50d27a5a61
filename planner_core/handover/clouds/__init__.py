"""Clouds of the stations, simulated beam by beam, in the formats of point-cloud programs."""
