"""etc_engine: effective thermal conductivity of particle systems and its statistics."""

from __future__ import annotations

__all__: list[str] = []
