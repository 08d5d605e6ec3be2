"""A tow as a functional mock-up unit (FMI 2 and 3, co-simulation): ship motion and winch command in, forces out."""
