"""One packing on many ranks: each holds the particles of one block of the box, and copies of their neighbours."""
