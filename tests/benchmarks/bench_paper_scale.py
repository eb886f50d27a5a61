"""The paper's scale on one device: visibility of thousands of candidates of an HDL-64E in 2.6 million triangles.

    python -m tests.benchmarks.bench_paper_scale [--candidates 10000] [--device NAME] [--range 120]

What a planner waits for: the tree, then what every candidate sees, rows back on the host. Scene: the finely tessellated
office of `bench_scan.py`; candidates: random points inside. Prints seconds by stage, candidates and beams a second, and
how long 10 000 take at that rate. The goal of a data-centre GPU, tree included: 10 000 in 60 s. Kernels are compiled
first, and do not count. Runs on any device: fewer candidates where it is slow. Not a test.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np

from planner_core.device import open_device
from planner_core.engine.opencl import OpenCLEngine
from planner_core.engine.tuning import tile_shape
from planner_core.scanner.load_scanner import load_scanner
from planner_core.scanner.template import make_template
from planner_core.scene.patches import make_patches
from tests.benchmarks.bench_scan import raycasting_of, stations_of
from tests.benchmarks.offices import office, processor

GOAL_CANDIDATES, GOAL_S = 10_000, 60.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--candidates", type=int, default=GOAL_CANDIDATES, help="how many are scanned")
    parser.add_argument("--device", help="as of tlsplan; default: the one that tlsplan takes")
    parser.add_argument("--range", type=float, default=np.inf, help="limit of range in metres; default: none")
    options = parser.parse_args()
    device = open_device(options.device)
    scene = office(16, 20, seed=1)
    patches = make_patches(scene, max_area_m2=0.04)
    template = replace(make_template(load_scanner("hdl-64e")), range_max_m=options.range)
    inside = stations_of(scene, options.candidates, raycasting_of(scene))
    candidates = np.resize(inside, (options.candidates, 3))
    OpenCLEngine(scene, patches, device).visible_patches(template, candidates[:2])  # compiles
    start = time.perf_counter()
    engine = OpenCLEngine(scene, patches, device)
    built = time.perf_counter()
    seen = engine.visible_patches(template, candidates)
    done = time.perf_counter()
    a_candidate_s = (done - built) / len(candidates)
    at_goal_s = built - start + GOAL_CANDIDATES * a_candidate_s
    met = "met" if at_goal_s <= GOAL_S else "missed"
    n_beams, n_seen = template.shape[0] * template.shape[1], seen.patch.size / len(candidates)
    for line in (
        f"{processor()}; {device.label}, tiles of {tile_shape(device)}",
        f"{scene.n_triangles} triangles, {patches.n_patches} patches, {n_beams} beams, range {options.range} m",
        f"tree {built - start:.2f} s; {len(candidates)} candidates {done - built:.2f} s",
        f"{1e3 * a_candidate_s:.2f} ms and {n_seen:.0f} patches each, {n_beams / a_candidate_s / 1e6:.0f} Mbeams/s",
        f"{GOAL_CANDIDATES} at this rate, with the tree: {at_goal_s:.1f} s, goal {GOAL_S:.0f} s: {met}",
    ):
        print(line)


if __name__ == "__main__":
    main()
