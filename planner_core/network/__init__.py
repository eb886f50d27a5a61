"""The registration network: overlap of stations, how strong each link is, what is connected."""
