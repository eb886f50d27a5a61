"""Many processes for one: Dask workers do tasks and errands, and what comes of it is that of one process to the byte.

`connection` is a `Cluster` that is connected, `crew` finds out who of it is fit, `deal` deals tasks out and puts the
answers in order (scanning, links); `errands` has folders made by workers and fetches them (jobs of a batch, clouds of
stations). `worker` and `workplace` are what runs on workers, `parcels` what travels. Nothing else imports Dask, and
only where it is used: `tlsplan[cluster]`.
"""
