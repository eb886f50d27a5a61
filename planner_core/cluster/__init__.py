"""Many processes for one: Dask workers do tasks and file jobs, and what comes of it is that of one process to the byte.

`executor` opens a `Cluster`, which is a `connection` that gives work away: `worker_pool` finds out which workers are
fit, `task_dispatcher` deals tasks out and puts the answers in order (scanning, links), `file_jobs` has folders made by
workers and fetches them (jobs of a batch, clouds of stations). `worker` and `worker_files` are what runs on workers,
`payloads` what travels. Nothing else imports Dask, and only where it is used: `tlsplan[cluster]`.
"""
