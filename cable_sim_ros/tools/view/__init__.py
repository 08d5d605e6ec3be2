"""The tow as one can watch it: a page in the browser beside a node or on a bag, and a film for a slide."""
