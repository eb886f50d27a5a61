"""The default OpenCL device: `make test` installs one, so its absence is a failure."""
