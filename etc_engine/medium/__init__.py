"""The medium: a packing, what its particles and pores are made of, and the links between neighbours."""
