"""Foreign logs made bags that run, replay and live take: motion, measured channels, provenance."""
