"""Logs of ship's instruments: sentences and telegrams as text, small binary records; one format a file."""
