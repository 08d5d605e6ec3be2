"""A line of one's own on the product's element, water, contact and integrator."""
