"""`tlsplan batch`: many buildings or storeys, each a job that is done once and kept.

`sites_file` reads what is to be planned, `jobs` makes jobs of it, `folder` keeps what they gave, `runner` runs them in
processes of their own, `summary` reports the results.
"""
