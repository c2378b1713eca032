"""`python -m bifa` is the command `bifa`."""

from bifa.cli import main

main()
