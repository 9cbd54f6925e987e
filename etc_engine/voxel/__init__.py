"""FFT homogenization: the effective conductivity of images and of disks and spheres in a matrix."""

from etc_engine.voxel.cell import CellSolution, solve_cell
from etc_engine.voxel.homogenize import homogenize_voxel
from etc_engine.voxel.voxelization import VoxelImage, voxelize

__all__ = ["CellSolution", "VoxelImage", "homogenize_voxel", "solve_cell", "voxelize"]
