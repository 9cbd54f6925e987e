"""Pictures of packings, fields and results; the only importer of matplotlib (extra ``plot``)."""

from etc_engine.output.figures.bed import draw_bed, draw_over_temperature
from etc_engine.output.figures.canvas import png, save
from etc_engine.output.figures.comparison import draw_comparison, save_comparison
from etc_engine.output.figures.convergence import draw_convergence, draw_histograms, draw_system_sizes
from etc_engine.output.figures.field import save_field
from etc_engine.output.figures.packing import save_packing
from etc_engine.output.figures.structure import draw_structure, save_structure

__all__ = [
    "draw_bed",
    "draw_comparison",
    "draw_convergence",
    "draw_histograms",
    "draw_over_temperature",
    "draw_structure",
    "draw_system_sizes",
    "png",
    "save",
    "save_comparison",
    "save_field",
    "save_packing",
    "save_structure",
]
