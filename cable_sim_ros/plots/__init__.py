"""Every picture, in one style. Needs the extra [viz] when one is drawn."""
