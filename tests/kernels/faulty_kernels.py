"""Kernels with faults on purpose, for the checker to find: `python tests/kernels/faulty_kernels.py FAULT`."""

import json
import sys

import numpy as np

from planner_core.device.choice import open_unchecked

KERNELS = {
    "none": "kernel void k(global int *x) { x[get_global_id(0)] = 1; }",
    "out-of-bounds": "kernel void k(global int *x) { x[get_global_id(0) + 1] = 1; }",
    "race": "kernel void k(global int *x) { x[0] += get_global_id(0); }",
    "uninitialised": "kernel void k(global int *x) { int y[2]; y[1] = 1; x[get_global_id(0)] = y[x[7] & 1]; }",
}

if __name__ == "__main__":
    device = open_unchecked(0)
    x = device.upload("x", {"x": np.zeros(8, dtype=np.int32)})["x"]
    device.program_from_source(KERNELS[sys.argv[1]], title="faulty.cl", defines={}).run("k", (8,), x)
    device.finish("faulty kernel")
    print(json.dumps({"kernels": ["k"], "results": ""}))
