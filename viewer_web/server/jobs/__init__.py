"""Planning jobs, called runs: a plan is made again beside the one that is shown, in a process of its own."""
