"""Every picture; the only place that imports matplotlib."""

from etc_engine.figures.field import save_field

__all__ = ["save_field"]
