"""The version. Imports nothing."""

__version__ = "0.2.0"
