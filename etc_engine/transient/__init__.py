"""Heat conduction in time through contact networks: moving particles."""
