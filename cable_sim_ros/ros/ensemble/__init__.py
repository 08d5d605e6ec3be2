"""Ears and voice of an ensemble beside a node."""
