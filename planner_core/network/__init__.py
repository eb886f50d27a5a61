"""The registration network: overlap of stations, how strong each link is, what hangs together."""
