"""Method ``exact``: the flux resolved over every contact chord of the true cut disk."""
