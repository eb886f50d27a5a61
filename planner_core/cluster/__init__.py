"""One plan over many processes: Dask workers look around, the plan is that of a single process to the byte.

`spread` deals positions out and puts the answers in order, `worker` is what runs on workers, `parcels` is what travels.
Nothing else imports Dask, and only where it is used: the extra `tlsplan[cluster]`.
"""
