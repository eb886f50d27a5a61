"""Scan engines: rays, scans and visible patches, by OpenCL kernels or by Open3D."""
