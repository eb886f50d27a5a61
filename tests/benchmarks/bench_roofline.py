"""Where the kernels stand under the machine's roofline: operations and bytes a beam, and their share of the peak.

    python -m tests.benchmarks.bench_roofline [--write docs/benchmarks/roofline.md]

The synthetic office of `bench_scan`, one station. Counted: oclgrind runs the kernels, unoptimised, in the same tiles
and packets as the device takes, and counts what they execute. A fused multiply-add counts twice. Of additions,
products, divisions and comparisons it does not tell how wide they are: they count as eight, the width of culling; those
of packets of sixteen are twice that. Timed: the kernel's own time as the driver's events tell it, best of turns, as the
peaks are: chains of multiply-adds in registers; sums of arrays far larger than the caches. Not a test: nothing here
can fail.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyopencl

from planner_core.device import Device, open_device
from planner_core.engine import opencl
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.patch_mode import PatchMode
from planner_core.engine.tuning import tile_shape, use_shape
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import make_template
from planner_core.scene.patches import make_patches
from tests.benchmarks.bench_scan import PATCH_AREA_M2
from tests.benchmarks.offices import office, processor

STATION_M = np.array([[15.0, 12.0, 1.7]])
#: Patch mode is counted in a smaller office: oclgrind would take an hour for the whole.
PATCH_ROOMS = 1
PATCH_STATION_M = np.array([[3.0, 2.5, 1.7]])
N_RAYS = 10_000
ROUNDS = 15
#: What is run, the kernel that does most of it, and what one unit of its work is called.
SUBJECTS = {
    "HDL-64E, no limit, all results": ("scan_tiles", "beam"),
    "HDL-64E, no limit, visibility": ("list_patches", "beam"),
    f"{N_RAYS} free rays": ("cast_rays", "ray"),
    "RTC360, patch mode, one room": ("sample_patches", "patch"),
}
FLOATS = 8
#: Instructions of one floating-point operation each in every lane; multiply-adds are told apart by their width.
PLAIN = ("fadd", "fsub", "fmul", "fdiv", "fcmp")

#: Chains enough to fill two pipelines of four steps.
_CHAINS = 16
#: Operators: PoCL's own `fma` is a call on processors it does not know, docs/decisions/0012.
_PEAK = """
kernel void multiply_add(global float *out, int n) {
#pragma OPENCL FP_CONTRACT ON
    WIDE a[CHAINS];
#pragma unroll
    for (int k = 0; k < CHAINS; ++k) a[k] = (WIDE)(k + get_global_id(0));
    for (int i = 0; i < n; ++i)
#pragma unroll
        for (int k = 0; k < CHAINS; ++k) a[k] = a[k] * 0.999f + 1.0f;
    WIDE sum = 0;
#pragma unroll
    for (int k = 0; k < CHAINS; ++k) sum += a[k];
    out[get_global_id(0)] = sum.s0 + sum.s3 + sum.s7;
}
kernel void sum_up(global const WIDE *in, global float *out, int n) {
    WIDE sum = 0;
    for (int i = 0; i < n; ++i) sum += in[get_global_id(0) * (size_t)n + i];
    out[get_global_id(0)] = sum.s0 + sum.s3 + sum.s7;
}
"""


@dataclass(frozen=True)
class Counted:
    """One launch: floating-point operations, and bytes that it loads from and stores to the device's memory."""

    operations: float
    n_bytes: float


def timed_kernels(device: Device) -> dict[str, list[float]]:
    """Milliseconds of every launch from now on, by kernel; filled as they are looked at."""
    device.queue = pyopencl.CommandQueue(device.context, properties=pyopencl.command_queue_properties.PROFILING_ENABLE)
    took: dict[str, list[float]] = defaultdict(list)
    launch = pyopencl.enqueue_nd_range_kernel

    def timed(queue: Any, kernel: Any, *arguments: Any) -> Any:
        event = launch(queue, kernel, *arguments)
        event.wait()
        took[kernel.function_name].append(1e-6 * (event.profile.end - event.profile.start))
        return event

    pyopencl.enqueue_nd_range_kernel = timed
    return took


def run_subjects(device: Device, rounds: int) -> dict[str, int]:
    """Everything that is counted and timed, `rounds` times; how many units of work each kernel had."""
    scene = office(36, 3, seed=1)
    patches = make_patches(scene, max_area_m2=PATCH_AREA_M2)
    engine = OpenCLEngine(scene, patches, device)
    hdl = replace(make_template(load_scanner("hdl-64e")), range_max_m=np.inf)
    rtc = make_template(load_scanner("rtc360"))
    rng = np.random.default_rng(3)
    rays = rng.normal(size=(N_RAYS, 6))
    rays[:, :3] = rng.uniform(scene.vertices_m.min(axis=0), scene.vertices_m.max(axis=0), (N_RAYS, 3))
    rays[:, 3:] /= np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)
    packed = rays.astype(np.float32)
    small = office(PATCH_ROOMS, 3, seed=1)
    small_patches = make_patches(small, max_area_m2=PATCH_AREA_M2)
    mode = PatchMode(OpenCLEngine(small, small_patches, device), small, small_patches)
    for _ in range(rounds):
        engine.scan(hdl, STATION_M)
        engine.visible_patches(hdl, STATION_M)
        engine.cast_prepared(packed, range_max_m=np.inf)
        mode.visible_patches(rtc, PATCH_STATION_M)
    n_beams = hdl.azimuth_rad.size * hdl.elevation_rad.size
    return {
        "scan_tiles": n_beams,
        "list_patches": n_beams,
        "cast_rays": N_RAYS,
        "sample_patches": small_patches.n_patches,
    }


def child(*arguments: str, under: tuple[str, ...] = ()) -> str:
    """Run this file again, and return what it said."""
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    if under:
        # A program of the cache would be one that was built with other options.
        environment |= {"PYOPENCL_NO_CACHE": "1"}
        environment.pop("TLSPLAN_DEVICE", None)
    command = [*under, sys.executable, str(Path(__file__).resolve()), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout


def counts_of(report: str) -> dict[str, list[Counted]]:
    """Launches by kernel, from oclgrind's histograms."""
    launches: dict[str, list[Counted]] = defaultdict(list)
    for part in report.split("Instructions executed for kernel '")[1:]:
        operations = n_bytes = 0.0
        for number, what in re.findall(r"^\s+(\d+) - (.*)$", part, re.MULTILINE):
            fused = re.match(r"call (?:llvm\.fmuladd\.|_Z3fma|_Z3mad)(?:v|Dv)?(\d*)", what)
            if fused:
                operations += 2.0 * int(number) * int(fused[1] or 1)
            elif what in PLAIN:
                operations += float(FLOATS) * int(number)
            elif moved := re.match(r"(?:load|store) global \((\d+) bytes\)", what):
                n_bytes += int(moved[1])
        launches[part.partition("'")[0]].append(Counted(operations, n_bytes))
    return launches


def peaks(device: Device) -> tuple[float, float]:
    """Operations and bytes of memory a nanosecond, best of turns."""
    lanes = device.max_lanes
    options = [f"-DWIDE=float{lanes}", f"-DCHAINS={_CHAINS}"]
    built = pyopencl.Program(device.context, _PEAK).build(options=options)
    multiply_add, sum_up = pyopencl.Kernel(built, "multiply_add"), pyopencl.Kernel(built, "sum_up")
    queue = pyopencl.CommandQueue(device.context, properties=pyopencl.command_queue_properties.PROFILING_ENABLE)
    n_items, steps = 8 * device.n_compute_units, 200_000
    flags = pyopencl.mem_flags
    out = pyopencl.Buffer(device.context, flags.READ_WRITE, 4 * n_items)
    many = np.ones(2**28 // (n_items * lanes) * (n_items * lanes), dtype=np.float32)
    array = pyopencl.Buffer(device.context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=many)
    rows = many.size // lanes // n_items
    best = [np.inf, np.inf]
    for _ in range(7):
        compute = multiply_add(queue, (n_items,), (1,), out, np.int32(steps))
        stream = sum_up(queue, (n_items,), (1,), array, out, np.int32(rows))
        for k, event in enumerate((compute, stream)):
            event.wait()
            best[k] = min(best[k], event.profile.end - event.profile.start)
    return n_items * steps * _CHAINS * lanes * 2 / best[0], many.nbytes / best[1]


def as_markdown(took: dict[str, list[float]], counted: dict[str, list[Counted]], units: dict[str, int]) -> str:
    device = open_device()
    operations_a_ns, bytes_a_ns = peaks(device)
    rows, columns, lanes = tile_shape(device)
    lines = [
        "# Roofline",
        "Written by `make bench-roofline` (tests/benchmarks/bench_roofline.py, which says what is counted and how). "
        "What follows from it: [the scan engine](../method/scan-engine.md).",
        "",
        f"{processor()}, {os.cpu_count()} cores; {device.label}; tiles of {rows} x {columns} beams in packets of "
        f"{lanes}. Peaks, measured: {operations_a_ns:.0f} GFlop/s in registers, {bytes_a_ns:.0f} GB/s from memory: a "
        f"kernel of more than {operations_a_ns / bytes_a_ns:.0f} operations a byte is not held up by memory. The scene "
        "and its tree lie in the caches, so that bytes are loads, not memory's.",
        "",
        "| what | kernel | ms | operations | bytes | operations a byte | GFlop/s | of the peak | GB/s |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    table = []
    for what, (kernel, unit) in SUBJECTS.items():
        # Of several launches a round the longest is meant: kernels are launched again for what the first left over.
        launches, n = counted[kernel], units[kernel]
        total = Counted(sum(c.operations for c in launches), sum(c.n_bytes for c in launches))
        ms = float(np.array(took[kernel]).reshape(ROUNDS, -1).sum(axis=1).min())
        share = total.operations / (1e6 * ms) / operations_a_ns
        table.append(
            (
                share,
                f"| {what} | `{kernel}` | {ms:.2f} | {total.operations / n:.0f} a {unit} | {total.n_bytes / n:.0f} a "
                f"{unit} | {total.operations / total.n_bytes:.1f} | {total.operations / (1e6 * ms):.0f} | "
                f"{100 * share:.0f} % | {total.n_bytes / (1e6 * ms):.0f} |",
            )
        )
    return "\n".join([*lines, *(line for _, line in sorted(table, reverse=True)), ""])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=Path, help="also write the table to this Markdown file")
    parser.add_argument("--run", nargs=5, type=int, help=argparse.SUPPRESS)  # rounds, lanes at most, shape of a tile
    options = parser.parse_args()
    if options.run:
        rounds, max_lanes, *shape = options.run
        device = open_device()
        device.max_lanes = max_lanes
        took = timed_kernels(device) if rounds > 1 else {}
        if rounds == 1:
            opencl._CACHED_RESULTS_BYTES = sys.maxsize  # oclgrind 21.10 does not know hints about memory
        with use_shape((shape[0], shape[1], shape[2])):
            units = run_subjects(device, rounds)
        print(json.dumps({"units": units, "took": took}))
        return
    device = open_device()
    asked = [str(device.max_lanes), *map(str, tile_shape(device))]
    native = json.loads(child("--run", str(ROUNDS), *asked).splitlines()[-1])
    report = child("--run", "1", *asked, under=("oclgrind", "--inst-counts", "--build-options", "-cl-opt-disable"))
    text = as_markdown(native["took"], counts_of(report), native["units"])
    print(text)
    if options.write is not None:
        options.write.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
