"""Transients on contact networks: study files, systems, runs and restarts, moving particles."""
