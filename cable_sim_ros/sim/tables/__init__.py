"""Blocks of a scene as numbers and tables for kernels."""
