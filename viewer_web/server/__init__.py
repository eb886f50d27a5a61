"""The server of `tlsplan view`: one plan folder and its review, live figures while stations move, planning jobs."""
