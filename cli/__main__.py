"""`python -m tlsplan` is `tlsplan`."""

from .main import main

main()
