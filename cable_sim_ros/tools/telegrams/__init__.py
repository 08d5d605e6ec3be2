"""Telegrams of ship's instruments as bytes: one format a file; no clock, no socket."""
