"""The plan against where the scanner really stood: what moved, missing and further stations cost, and what to do."""
