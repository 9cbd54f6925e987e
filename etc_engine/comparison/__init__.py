"""Simulated conductivities against closed-form models: differences, bounds, and fits over a sweep."""

from etc_engine.comparison.evaluation import DEFAULT_MODELS, evaluate_models, model_curve
from etc_engine.comparison.fits import Fit, Parameter, fit_models
from etc_engine.comparison.simulation import Phases, phases

__all__ = ["DEFAULT_MODELS", "Fit", "Parameter", "Phases", "evaluate_models", "fit_models", "model_curve", "phases"]
