"""Coverage that `compare` tells: none that falls short reads as what was asked for, or as what was planned."""

import pytest
from tlsplan.commands.compare import _coverage


@pytest.mark.parametrize(
    ("planned", "actual", "told"),
    [
        (0.96, 0.94996, "96.0 % planned, just below 95 % as scanned   NOT MET"),
        (0.95, 0.95, "95.0 % planned, 95.0 % as scanned"),
        (0.94998, 0.94996, "just below 95 % planned, just below 95 % as scanned   NOT MET"),
        (0.94996, 0.94998, "just below 95 % planned, just below 95 % as scanned   not met, as in the plan"),
        (0.8568, 0.8566, "85.7 % planned, just below 85.7 % as scanned   NOT MET"),
    ],
)
def test_coverage_as_scanned_that_falls_short_reads_so(planned: float, actual: float, told: str) -> None:
    row = {
        "name": "overall", "asked": 0.95, "planned": planned, "actual": actual, "met": actual >= min(planned, 0.95),
        "planned_is_met": planned >= 0.95, "asked_is_met": actual >= 0.95,
    }  # fmt: skip
    (line,) = _coverage({"requirements": [row]})
    assert line == f"coverage      overall                  95.0 % required, {told}"
