"""Files for users: netCDF and VTK of a single solve, exports, figures, reports."""
