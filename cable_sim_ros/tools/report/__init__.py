"""A run as one HTML file that prints, for a reader who has never seen the product."""
