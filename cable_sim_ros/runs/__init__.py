"""Product over the floors 0 to 2: offline pass, replay, summary, picture, manual, bags made from data."""
