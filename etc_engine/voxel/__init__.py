"""FFT homogenization: the effective conductivity of images and of disks and spheres in a matrix."""

from etc_engine.voxel.cell import CellSolution, solve_cell

__all__ = ["CellSolution", "solve_cell"]
