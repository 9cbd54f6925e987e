"""FFT homogenization: the effective conductivity of images and of disks and spheres in a matrix."""

from etc_engine.engines.voxel.cell import CellSolution, Scheme, solve_cell
from etc_engine.engines.voxel.homogenize import homogenize_voxel
from etc_engine.engines.voxel.voxelization import VoxelImage, voxelize

__all__ = ["CellSolution", "Scheme", "VoxelImage", "homogenize_voxel", "solve_cell", "voxelize"]
