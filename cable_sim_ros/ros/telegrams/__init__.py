"""Telegrams of the instruments over UDP on this host: parameters and sender."""
