"""Saved simulations: files that anybody may have written."""
