"""The live side of the viewer: what stations that a reviewer moves are worth, answered while they are moved."""
