"""The command `tlsplan`."""
