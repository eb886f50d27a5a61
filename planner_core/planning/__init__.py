"""From a scene and what is required to a plan: candidates, choice, refinement, figures."""
