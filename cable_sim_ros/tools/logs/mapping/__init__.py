"""Mappings: which source and field of a log is which quantity, in what unit, sign, axes and time."""
