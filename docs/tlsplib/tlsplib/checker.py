"""Check a certificate of TLSPLIB: the plan meets what is required, and no plan has fewer stations than the bound.

Run as `python checker.py INSTANCE CERTIFICATE`, each .json or .json.xz; exit code 1 where it is refused. Nothing but
Python's own library and whole numbers, no code of the solvers; docs/tlsplib/formats.md proves that it holds.
"""

import hashlib
import json
import lzma
import sys
from functools import reduce
from pathlib import Path
from typing import Any

MOST_BYTES, MOST_DIGITS = 256 << 20, 18  # of a file; of a number, of which none has a fraction
ONE, SHARE, LOOKS = 2**24, 256, 840  # 1 in coefficients, in shares that make them, and what 1 to 8 looks divide
Cut = tuple[dict[int, int], int]  # coefficients by candidate, right side: sum of coefficients times x >= right side


class RefusedError(ValueError):
    """A file does not hold what it claims."""


def demand(holds: object, message: str) -> None:
    if not holds:
        raise RefusedError(message)


def number(value: Any, low: int, high: int, what: str) -> int:
    demand(type(value) is int and low <= value <= high, f"{what}: got {value!r:.40}, expected {low} to {high}")
    return int(value)


def unpacked(packed: bytes) -> bytes:
    if not packed.startswith(b"\xfd7zXZ\x00"):
        return packed
    raw = (unpacker := lzma.LZMADecompressor()).decompress(packed, MOST_BYTES)
    demand(unpacker.eof and not unpacker.unused_data, "truncated or too large a file")
    return raw


def parsed(raw: bytes, form: str) -> dict[str, Any]:
    def whole(text: str) -> int:
        demand(len(text) <= MOST_DIGITS and text.lstrip("-").isdigit(), f"got {text:.30}, expected whole numbers")
        return int(text)

    document = json.loads(raw.decode("ascii"), parse_float=whole, parse_constant=whole, parse_int=whole)
    demand(isinstance(document, dict) and document.get("format") == form, f"got another format, expected {form}")
    return dict(document)


def members(mask: int) -> list[int]:
    return [i for i, bit in enumerate(reversed(bin(mask))) if bit == "1"]


def bits(text: Any, size: int) -> int:
    demand(isinstance(text, str) and 0 <= (mask := int(text or "0", 16)) < 1 << size, "set: no members, or too many")
    return mask


class Instance:
    """The problem: sees[i] and links[i] are sets as bits of one number, rows[i] the first as a list."""

    def __init__(self, raw: bytes) -> None:
        document = parsed(raw, "tlsplib instance 1")
        self.name, self.digest = str(document["name"]), hashlib.sha256(raw).hexdigest()
        self.ticks = [number(t, 1, 10**12, "ticks") for t in document["ticks"]]
        self.n, size = len(document["sees"]), len(self.ticks)
        self.sees = [bits(text, size) for text in document["sees"]]
        self.rows = [members(sees) for sees in self.sees]
        needs = [(c["rows"], c["required"], c["seen_from"]) for c in document["constraints"]]
        self.needs = [(bits(r, size), number(a, 1, 10**15, "need"), number(m, 1, 8, "need")) for r, a, m in needs]
        self.links = None if document["links"] is None else [bits(text, self.n) for text in document["links"]]
        ends = {(i, j) for i, near in enumerate(self.links or ()) for j in members(near)}
        demand(len(self.links or self.sees) == self.n and all((j, i) in ends and i != j for i, j in ends), "one-sided")

    def meets(self, candidates: list[int]) -> bool:
        """Whether the candidates together reach what every constraint requires."""
        seen = [-1] + [0] * max(m for _, _, m in self.needs)  # seen[m]: rows that m of them see, or more
        for i in candidates:
            for m in range(len(seen) - 1, 0, -1):
                seen[m] |= seen[m - 1] & self.sees[i]
        return all(sum(self.ticks[r] for r in members(seen[m] & rows)) >= least for rows, least, m in self.needs)

    def pieces(self, allowed: int) -> list[int]:
        """Connected components of the allowed candidates; all of them as one where no links are required."""
        found = [allowed] if self.links is None else []
        while self.links is not None and allowed:
            piece = new = allowed & -allowed
            while new:
                new = reduce(int.__or__, (self.links[i] for i in members(new))) & allowed & ~piece
                piece |= new
            found, allowed = [*found, piece], allowed & ~piece
        return found

    def cover_cut(self, k: int, pairs_given: list[int]) -> tuple[list[int], list[int], int]:
        """Of constraint k and shares of stations: weights of rows, what each candidate is spared, the right side."""
        (counted, required, m), full, spared = self.needs[k], 0, [0] * self.n
        weight = [t * (LOOKS // m) * (counted >> r & 1) for r, t in enumerate(self.ticks)]
        pairs = zip(pairs_given[::2], pairs_given[1::2], strict=True)
        shares = {number(i, 0, self.n - 1, "cut"): -number(v, 0, SHARE, "share") for i, v in pairs}
        seers: dict[int, list[tuple[int, int]]] = {}
        for i, share in shares.items():
            for r in filter(weight.__getitem__, self.rows[i]):
                seers.setdefault(r, []).append((share, i))
        for r, found in seers.items():
            found.sort()  # the t largest shares are left out, with the t of least weight
            least, left_out = min((-sum(v for v, _ in found[t:]) * LOOKS // (m - t), t) for t in range(m))
            weight[r] = self.ticks[r] * (LOOKS // (m - left_out))
            if least >= SHARE * LOOKS:
                full, weight[r] = full + self.ticks[r], 0
            for _, i in found[:left_out]:
                spared[i] += weight[r]
        return weight, spared, (required - full) * LOOKS

    def rows_cut(self, k: int, values: list[int]) -> tuple[list[int], list[int], int]:
        """The same of constraint k and shares of its rows; with links, what the one before sees is spared."""
        (counted, required, m), weight, spared = self.needs[k], [0] * len(self.ticks), [0] * self.n
        for r, v in zip(members(counted), values, strict=True):
            weight[r], required = number(v, 0, SHARE, "share") * self.ticks[r], required - self.ticks[r]
        if self.links and m == 1:  # all but the first stand after a linked one
            own = [set(filter(weight.__getitem__, rows)) for rows in self.rows]
            for i, near in enumerate(map(members, self.links)):
                spared[i] = min((sum(map(weight.__getitem__, own[i] & own[j])) for j in near), default=0)
        return weight, spared, m * (sum(weight) + SHARE * required) - max(spared)

    def links_cut(self, between: list[int], paid: list[int]) -> Cut:
        """x(between) >= 1, x_i or x_i + x_j - 1 for `paid` of none, i, or i and j."""
        pieces = self.pieces((1 << self.n) - 1 - sum(1 << i for i in set(between)))
        home = [next((p for p in pieces if p >> i & 1), 0) for i in paid]
        demand(self.links and all(home) and len(paid) <= 2, "cut of links: no links, or one in between")
        # Without any in between, the plan would lie in one piece: in one that falls short, or in two at once.
        alone = len(paid) == 2 or any(map(self.meets, map(members, home or pieces)))
        demand(len(set(home)) == 2 or not alone, "cut of links: a piece will do alone, or holds both")
        return dict.fromkeys(between, ONE) | dict.fromkeys(paid, -ONE), (1 - len(paid)) * ONE

    def cut(self, kind: str, first: Any, rest: list[int]) -> Cut:
        if kind == "links":
            return self.links_cut(*([number(i, 0, self.n - 1, "cut") for i in some] for some in (first, rest)))
        demand(kind in ("cover", "rows"), "cut: got another kind, expected cover, rows or links")
        make = self.rows_cut if kind == "rows" else self.cover_cut
        weight, spared, right = make(number(first, 0, len(self.needs) - 1, "constraint"), rest)
        demand(right > 0, "cut: its rows alone meet the constraint")
        seen = (sum(map(weight.__getitem__, rows)) - less for rows, less in zip(self.rows, spared, strict=True))
        return {i: -(-min(a, right) * ONE // right) for i, a in enumerate(seen) if a}, ONE

    def check_tree(self, bound: int, cuts: list[Cut], tree: list[Any]) -> None:
        """No leaf holds a plan of fewer than `bound` stations, and the branches leave nothing out."""
        stack: list[tuple[list[int], list[int], list[Cut]]] = [([0] * self.n, [1] * self.n, [])]
        for place, (precision, prices, branch) in enumerate(tree):
            lower, upper, path = stack.pop()  # of none left: a node of no branch
            one, rows = ONE << number(precision, 0, 40, "bits of prices"), cuts + path
            value, margin = 0, [one] * self.n
            for c, p in zip(prices[::2], prices[1::2], strict=True):
                coefficients, right = rows[number(c, 0, len(rows) - 1, "cut")]
                value += number(p, 0, 2**50, "price") * right
                for i, a in coefficients.items():
                    margin[i] -= p * a
            value += sum(m * (high if m < 0 else low) for m, low, high in zip(margin, lower, upper, strict=True))
            goal = (bound - 1) * one  # what is more than this rounds up to the bound
            closed = value > goal or any(map(int.__gt__, lower, upper))
            for i, m in enumerate(margin):  # a smaller plan does without i, or needs i
                if lower[i] < upper[i] and value + abs(m) > goal:
                    lower[i] = upper[i] = int(m < 0)
            if branch is None:
                forced, allowed = (sum(1 << i for i, x in enumerate(side) if x) for side in (lower, upper))
                closed = closed or not any(self.meets(members(p)) for p in self.pieces(allowed) if not forced & ~p)
                demand(closed, f"tree: node {place} may hold a plan of fewer than {bound} stations")
                continue
            most, *group = [number(v, 0, self.n, "branch") for v in branch]
            demand(group and len(set(group)) == len(group) and max(group) < self.n, "branch: got no candidates")
            for side, sign in ((1, 1), (0, -1)):  # more than `most` of the group, or no more, which comes first
                low, high = lower.copy(), upper.copy()
                if len(group) == 1 and most == 0:
                    low[group[0]], high[group[0]] = max(side, low[group[0]]), min(side, high[group[0]])
                stack.append((low, high, [*path, (dict.fromkeys(group, sign * ONE), (sign * most + side) * ONE)]))
        demand(not stack, "tree: truncated, a branch has no node")


def check(instance: bytes, certificate: bytes) -> tuple[str, int, int]:
    """Name, stations and proven bound of two files. Raises RefusedError, of one line, where they do not hold."""
    try:
        problem, document = Instance(unpacked(instance)), parsed(unpacked(certificate), "tlsplib certificate 1")
        demand(document["sha256"] == problem.digest, "certificate: it is one of another instance, its sha256 differs")
        plan = [number(i, 0, problem.n - 1, "plan") for i in document["plan"]]
        demand(len(set(plan)) == len(plan) and problem.meets(plan), "plan: a station twice, or it misses a constraint")
        demand(len(problem.pieces(sum(1 << i for i in plan))) == 1, "plan: its stations are not connected by links")
        bound = number(document["bound"], 1, len(plan), "bound")
        problem.check_tree(bound, [problem.cut(*cut) for cut in document["cuts"]], document["tree"])
    except (KeyError, TypeError, AttributeError, ValueError, IndexError, RecursionError, lzma.LZMAError) as error:
        raise error if isinstance(error, RefusedError) else RefusedError(f"not as in the format: {error!r}") from None
    return problem.name, len(plan), bound


if __name__ == "__main__":
    try:
        demand(len(sys.argv) == 3, "usage: python checker.py INSTANCE CERTIFICATE")
        sys.stdout.write("{}: {} stations, at least {}\n".format(*check(*(Path(p).read_bytes() for p in sys.argv[1:]))))
    except (RefusedError, OSError) as error:
        sys.exit(f"refused: {error}")
