"""The discrete thermal element method: disks as elements, contacts as nodes."""
