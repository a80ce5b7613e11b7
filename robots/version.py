"""The version that results carry."""

from importlib.metadata import PackageNotFoundError, version

try:
    VERSION = version("robot-oed")
except PackageNotFoundError:  # run from a source tree that was never installed
    VERSION = "0+unknown"
__version__ = VERSION
