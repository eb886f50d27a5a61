"""What the campaign's rows come to: shares that register, and the probability as a function of what is known before.

Rows of docs/benchmarks/registration/*.csv -> tables in Markdown, and a logistic rule, tested on scenes that it has not
seen.
"""

from __future__ import annotations

import csv
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from planner_core.model import BoolArray, FloatArray, Requirements
from planner_core.network.links import LEAST_HOLD_M2, link_figures
from planner_core.network.pair_overlap import HeldPairs

NEAR_MM, NEAR_DEG = 10.0, 0.1
"""A pair is registered when it is as near to the truth."""
_RIDGE = 1e-2
MADE_OF = {
    "angel-house": 495, "atrium": 82, "basement": 801, "classroom": 1000, "column-hall": 1000, "corridor-comb": 1000,
    "doors-open": 686, "double-height-hall": 1000, "duplex-outside": 344, "duplex": 424, "fzk-haus-outside": 330,
    "fzk-haus": 840, "glass-and-mirror": 1000, "house": 957, "l-room": 1000, "openhouse": 1000,
    "renga-house-outside": 330, "renga-house": 370, "sample-house-outside": 330, "sample-house": 644,
    "schependomlaan": 718, "school": 314, "stairwell": 751, "t-corridor": 1000, "tested-sample": 1000,
    "thin-walls": 1000, "tunnel": 1000, "two-rooms": 1000,
}  # fmt: skip
"""So many first rows of these scenes make the rule, and none of the others. Later rows test it, unseen."""
_NEVER_LOWERS = (0.0, None)
_SIGNS = (_NEVER_LOWERS, _NEVER_LOWERS)
"""Of the weights of `FEATURES`: more in common never lowers a probability."""
FEATURES = ("ln m2 that hold", "logit overlap above a half")
"""Tried beside these on scenes that a rule has not seen, and no better: common area, range, strength, and surface that
may be mistaken for another."""


@dataclass(frozen=True)
class Rows:
    """The campaign. scene : (N,). is_later : (N,), see `MADE_OF`. known : (N,) by name. errors: (N, 2), mm and deg, by
    start and method.
    """

    scene: np.ndarray[tuple[int], np.dtype[np.str_]]
    is_later: BoolArray
    known: dict[str, FloatArray]
    errors: dict[tuple[str, str], FloatArray]

    def registered(self, start: str, method: str) -> FloatArray:
        """(N,) 1, 0, or NaN where it was not tried."""
        errors = self.errors[start, method]
        near = (errors[:, 0] <= NEAR_MM) & (errors[:, 1] <= NEAR_DEG)
        return np.where(np.isnan(errors[:, 0]), np.nan, near.astype(float))

    @property
    def is_strong(self) -> BoolArray:
        """(N,) of pairs that are strong enough to count as links."""
        return np.asarray(self.known["strength"] >= Requirements().min_strength)

    @property
    def is_held(self) -> BoolArray:
        """(N,) of pairs that the rule is made of."""
        return np.asarray(self.is_strong & (self.known["hold_m2"] >= LEAST_HOLD_M2))

    def rule(self, start: str, method: str) -> Rule:
        """Make the rule of the rows that are there for it."""
        registered = self.registered(start, method)
        of = ~np.isnan(registered) & ~self.is_later & self.is_held
        return fitted(features(self.known)[of], registered[of])


def read_rows(folder: Path, starts: Sequence[str], methods: Sequence[str]) -> Rows:
    """Read all tables of a folder."""
    scenes: list[str] = []
    is_later: list[bool] = []
    rows: list[dict[str, str]] = []
    for table in sorted(folder.glob("*.csv")):
        with table.open(encoding="utf-8", newline="") as file:
            here = list(csv.DictReader(file))
        rows += here
        scenes += [table.stem] * len(here)
        is_later += [number >= MADE_OF.get(table.stem, 0) for number in range(len(here))]
    number = {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}
    errors = {
        (start, method): np.column_stack([number[f"{start}_{method}_mm"], number[f"{start}_{method}_deg"]])
        for start in starts
        for method in methods
    }
    return Rows(np.array(scenes), np.array(is_later), number, errors)


def held_of(known: dict[str, FloatArray]) -> HeldPairs:
    """What the rows' common surfaces hold."""
    return HeldPairs(known["strength"], known["hold_m2"])


def features(known: dict[str, FloatArray]) -> FloatArray:
    """(N, F) what the rule takes, see `FEATURES`."""
    return link_figures(known["overlap"], held_of(known))


@dataclass(frozen=True)
class Rule:
    """p = 1 / (1 + exp(-(w0 + w . x))). weight : (F + 1,), the constant first."""

    weight: FloatArray

    def probability(self, x: FloatArray) -> FloatArray:
        """(N,) of (N, F) features."""
        return np.asarray(1.0 / (1.0 + np.exp(-(self.weight[0] + x @ self.weight[1:]))))


def fitted(x: FloatArray, y: FloatArray) -> Rule:
    """Fit by maximum likelihood with a slight ridge, on standardised features; no weight against its sign."""
    mean, spread = x.mean(axis=0), np.maximum(x.std(axis=0), 1e-9)
    z = np.column_stack([np.ones(len(x)), (x - mean) / spread])

    def loss(weight: FloatArray) -> tuple[float, FloatArray]:
        margin = z @ weight
        value = np.logaddexp(0.0, margin).sum() - y @ margin + _RIDGE * (weight[1:] ** 2).sum()
        slope = z.T @ (1.0 / (1.0 + np.exp(-margin)) - y)
        slope[1:] += 2.0 * _RIDGE * weight[1:]
        return float(value), slope

    bounds = [(None, None), *_SIGNS]
    found = minimize(loss, np.zeros(z.shape[1]), jac=True, method="L-BFGS-B", bounds=bounds).x
    return Rule(np.concatenate([[found[0] - (found[1:] * mean / spread).sum()], found[1:] / spread]))


def foretold(rows: Rows, x: FloatArray, y: FloatArray) -> FloatArray:
    """(N,) probabilities of strong pairs, each by a rule made without the scene's own rows."""
    tried = ~np.isnan(y) & rows.is_strong
    out = np.full(len(y), np.nan)
    for scene in np.unique(rows.scene):
        made_of, tested = tried & rows.is_held & (rows.scene != scene), tried & (rows.scene == scene)
        if tested.any() and made_of.any():
            out[tested] = fitted(x[made_of], y[made_of]).probability(x[tested])
    return out


def shares_table(rows: Rows, starts: Sequence[str], methods: Sequence[str]) -> list[str]:
    """Shares that registered, by overlap and strength."""
    heads = [f"{start}, {method}" for start in starts for method in methods]
    lines = ["| overlap, strength | pairs | " + " | ".join(heads) + " |", "|---" * (len(heads) + 2) + "|"]
    least = Requirements().min_strength
    edges = (0.02, 0.05, 0.12, 0.2, 0.25, 0.3, 0.4, 1.01)
    for low, high in itertools.pairwise(edges):
        for strong in (True, False):
            overlap = rows.known["overlap"]
            here = (overlap >= low) & (overlap < high) & (rows.is_strong == strong)
            if not here.any():
                continue
            strength = f"{least:g} and more" if strong else f"below {least:g}"
            words = f"{100 * low:.0f} to {100 * min(high, 1.0):.0f} %, {strength}"
            cells = [_share(rows.registered(start, method)[here]) for start in starts for method in methods]
            lines.append(f"| {words} | {int(here.sum())} | " + " | ".join(cells) + " |")
    return lines


def _share(registered: FloatArray) -> str:
    tried = registered[~np.isnan(registered)]
    return f"{int(tried.sum())} of {tried.size}" if tried.size else ""


def rules_table(rows: Rows, starts: Sequence[str], methods: Sequence[str]) -> list[str]:
    """Weights of the rules of all rows, and how well rules do on scenes that they have not seen."""
    lines = [
        "| start, method | constant | " + " | ".join(FEATURES) + " | Brier score | of the mean alone |",
        "|---" * (len(FEATURES) + 4) + "|",
    ]
    x = features(rows.known)
    for start, method in itertools.product(starts, methods):
        y = rows.registered(start, method)
        tried = ~np.isnan(y) & rows.is_strong
        rule, p = rows.rule(start, method), foretold(rows, x, y)
        brier, mean = ((p[tried] - y[tried]) ** 2).mean(), y[tried].mean()
        weights = " | ".join(f"{weight:.2f}" for weight in rule.weight)
        lines.append(f"| {start}, {method} | {weights} | {brier:.3f} | {mean * (1 - mean):.3f} |")
    return lines


def reliability_table(rows: Rows, starts: Sequence[str], method: str) -> list[str]:
    """What registered, of pairs of about the same probability by rules that have not seen their scenes; in brackets, of
    pairs that overlap by less than 30 %.
    """
    x = features(rows.known)
    return _by_probability(rows, {start: foretold(rows, x, rows.registered(start, method)) for start in starts}, method)


def later_table(rows: Rows, starts: Sequence[str], method: str) -> list[str]:
    """The same of rows that came after the rule was made, by that rule."""
    x = features(rows.known)
    later = rows.is_later & rows.is_strong
    of = {start: np.where(later, rows.rule(start, method).probability(x), np.nan) for start in starts}
    return _by_probability(rows, of, method)


def _by_probability(rows: Rows, p_of: dict[str, FloatArray], method: str) -> list[str]:
    heads = [f"{start}: pairs | registered" for start in p_of]
    lines = ["| probability | " + " | ".join(heads) + " |", "|---" * (2 * len(heads) + 1) + "|"]
    below = rows.known["overlap"] < 0.3
    edges = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.99, 1.0001)
    for low, high in itertools.pairwise(edges):
        cells = []
        for start, p in p_of.items():
            y = rows.registered(start, method)
            here: BoolArray = (p >= low) & (p < high) & ~np.isnan(y)
            shares = [f"{100 * y[some].mean():.1f} %" if some.any() else "none" for some in (here, here & below)]
            cells.append(f"{here.sum()} ({(here & below).sum()}) | {shares[0]} ({shares[1]})")
        lines.append(f"| {100 * low:.0f} to {100 * min(high, 1.0):.0f} % | " + " | ".join(cells) + " |")
    return lines
