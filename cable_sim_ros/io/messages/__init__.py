"""Messages as bytes: what comes in checked, what goes out serialised once."""
