"""Drawings of floors (DXF, PDF, pictures), read, recognised and lifted to a building that is written as IFC4."""
