"""The cell element: disks in a conducting fluid, one thermal element for each Laguerre cell (two-dimensional)."""
