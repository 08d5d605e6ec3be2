"""Telegrams of ship's instruments as bytes, and back: one format a file; no clock, no socket."""
