"""What a simulation writes down: bag beside the loop, journal, what is read back of them."""
