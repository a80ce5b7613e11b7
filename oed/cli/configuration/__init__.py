"""Defaults of options from a configuration file, ``oed.toml``."""
