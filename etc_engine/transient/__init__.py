"""Transients on contact networks: the study file, the system it describes, the run and its restart."""
