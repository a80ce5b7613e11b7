"""Runs ``python -m oed``."""

from oed.cli import main

main()
