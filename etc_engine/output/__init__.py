"""What is written for users: netCDF and VTK of a single solve."""
