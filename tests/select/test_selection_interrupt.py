"""Selection under a real SIGINT, wherever it strikes: annealing, linear programs, the tree."""

import importlib
import json
import os
import signal
import subprocess
import sys
import threading
from dataclasses import asdict

import numpy as np
import pytest
from selection_instances import problem_of

from planner_core.model import Proven
from planner_core.select.check import check_selection
from planner_core.select.network import Network
from planner_core.select.proven import select

#: Seconds from the first sign of a stage to the signal.
DELAYS_S = (0.0, 0.02, 0.1)


def thicket():
    """Candidates that see rows at random: the relaxation is far from the optimum, and there is much to prove."""
    rng = np.random.default_rng(2)
    n, r = 80, 300
    sees, ticks = rng.random((n, r)) < 0.1, rng.integers(1, 50, r)
    required = np.array([int(0.9 * int(np.where(sees.any(axis=0), ticks, 0).sum()))])
    return problem_of(sees, ticks, np.ones((1, r), dtype=bool), required)


def ring(n=80):
    """Everybody is linked to the four next on either side."""
    at = np.arange(n)[:, None]
    near = np.sort((at + np.array([-4, -3, -2, -1, 1, 2, 3, 4])) % n, axis=1)
    return Network(np.arange(0, 8 * n + 1, 8), near.reshape(-1).astype(np.int32), np.zeros(n, dtype=np.int32))


def be_interrupted(stage, delay_s):
    """Result of a selection that gets a SIGINT some time after a stage has begun."""
    began = threading.Event()

    def strike():
        began.wait()
        threading.Event().wait(delay_s)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=strike, daemon=True).start()

    def note(event):
        if event.stage == stage and "trying" in event.note + "trying" * (stage != "select"):
            began.set()

    network = ring() if stage == "select" else None
    return select(thicket(), Proven(work_limit=1e6, n_walks=1), network=network, progress=note)


@pytest.mark.slow
@pytest.mark.parametrize("stage", ["select", "bound", "prove"])
def test_a_real_interrupt_returns_the_best_set_so_far_with_its_bound(stage):
    done = subprocess.run([sys.executable, __file__, stage], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    results = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(results) == len(DELAYS_S)
    for result in results:
        assert result["why_stopped"] == "interrupted"
        check_selection(thicket(), result["chosen"], network=ring() if stage == "select" else None)
        # Nowhere near done: a node or a cut that got lost would pass for a proof.
        assert 0 < result["lower_bound"] < len(result["chosen"]) <= result["n_greedy"]
        assert (result["curve"][-1]["stations"], result["curve"][-1]["bound"]) == (
            len(result["chosen"]),
            result["lower_bound"],
        )


if __name__ == "__main__":
    # CPython 3.11 exits by SIGINT in the end, without a word, when one struck text that an import executes, though it
    # was caught: the search is to be struck, not the imports that it comes upon.
    for module in ("highspy", "scipy.sparse.csgraph"):
        importlib.import_module(module)
    for delay_s in DELAYS_S:
        sys.stdout.write(json.dumps(asdict(be_interrupted(sys.argv[1], delay_s)), default=int) + "\n")
