"""Closed-form resistance laws of single particles, by dimension."""
