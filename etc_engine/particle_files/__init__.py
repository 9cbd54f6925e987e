"""Reads and writes particles; a format is one file and one row of the table."""
