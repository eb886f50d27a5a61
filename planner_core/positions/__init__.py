"""Where stations may stand: candidates, free space, what can be reached on foot, the site."""
