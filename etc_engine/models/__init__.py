"""Closed-form models and bounds of the effective conductivity; knows nothing of the engine."""

from etc_engine.models.catalogue import CATALOGUE, Input, Interval, Model, evaluate

__all__ = ["CATALOGUE", "Input", "Interval", "Model", "evaluate"]
