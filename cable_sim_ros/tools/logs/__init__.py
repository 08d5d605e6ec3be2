"""Recordings of others: readers of their formats, one record of what each gives, and what their fields mean."""
