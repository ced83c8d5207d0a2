"""`python -m meshshard` is the program `meshshard`."""

from meshshard.cli import main

main()
