"""OpenCL C sources; installed as `planner_core.kernels` and read by `planner_core.device`."""
