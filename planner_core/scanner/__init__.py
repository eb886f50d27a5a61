"""Scanners: their data sheets, modes, beams of a scan, range noise."""
