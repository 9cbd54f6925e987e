"""Closed-form resistance laws: arrays in, arrays out."""
