"""Floor 1: scene -> model, static start, Simulator."""
