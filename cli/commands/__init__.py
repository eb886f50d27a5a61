"""One command a file; each module has `command`, a click command, and imports nothing heavy at its top."""
