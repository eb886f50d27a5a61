"""Reasons: what each station adds, and why the unseen stays unseen."""
