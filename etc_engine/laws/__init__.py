"""Closed-form resistances of a particle between its contacts: arrays in, arrays out."""
