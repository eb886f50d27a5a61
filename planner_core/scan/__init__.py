"""Scanning: scanner specifications, beam templates, and the engines that cast beams into a scene."""
