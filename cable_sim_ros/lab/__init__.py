"""Side wing over floors 0-2: bags made from recorded data, pictures, summaries, experiments."""
