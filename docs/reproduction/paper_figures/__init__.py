"""The paper's figures, drawn again from our own runs: `tlsplan reproduce`, one module a figure.

A figure module has one function, `run(bench) -> Outcome`: it measures, draws into `bench.folder` and reports in words
with numbers what came out. `figures.py` lists them with what the paper found; `page.py` writes the page of each.
"""
