"""Numba as the product uses it: calls by symbol, a cache by content, lanes, compilation in worker processes."""
