"""Heat conduction through continuous 3D media by a lattice of particles."""
