"""What survives a crash: whole files or none, lock, stop, watch, identity of a run, provenance."""
