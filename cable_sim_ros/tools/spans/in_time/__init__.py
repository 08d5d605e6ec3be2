"""In time: a wake oscillator on every node (docs/wake.md)."""
