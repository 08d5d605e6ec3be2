"""Tools over the core: one folder each, found by their entry points; the core knows none of them."""
