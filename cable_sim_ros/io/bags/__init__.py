"""Bags and MCAP files as files: read, written, whatever is left of a damaged one."""
