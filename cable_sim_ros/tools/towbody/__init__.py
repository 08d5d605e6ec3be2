"""`cable-sim towbody`: trim, loads and stability of a body with an attitude."""
