"""A plan in the formats of other programs: instruments, drawings, GIS, point clouds, BIM, robots."""
