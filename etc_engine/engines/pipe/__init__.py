"""Pipe network: particles at their mean temperatures, joined by the resistances of their contacts."""
