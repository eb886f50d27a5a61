"""The first stage: a scene file becomes a `Scene`, its floors and its patches. Begin with `load`."""
