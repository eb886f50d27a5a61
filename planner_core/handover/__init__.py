"""A plan in the formats of others: instruments, drawings, GIS, point clouds, BIM, robots."""
