"""Furnished sites by lot, to judge answers on: what a mapping would hold of them, and what is true."""
