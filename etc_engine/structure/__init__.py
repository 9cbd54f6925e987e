"""What a packing looks like: its union, its statistics, its Laguerre tessellation."""
