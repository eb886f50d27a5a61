"""Set cover with proofs: which candidates to take, and how few there can be. Knows nothing of buildings."""
