"""What is in a log: rates, gaps, clocks, channels, and what is probably wrong with each, with its evidence."""
