"""The command `tlsplan`: one command a file in `commands/`; the only place of the project that prints and exits.

The folder `cli/` of the repository is installed as the package `tlsplan`.
"""
