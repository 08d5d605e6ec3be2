"""A shoal ahead of a tow: the least haul or more speed that clears it, and by when."""
