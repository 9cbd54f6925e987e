"""Simulated conductivities against closed-form models: differences, bounds, and fits over a sweep."""

from etc_engine.comparison.convergence import running_statistics, samples, system_sizes
from etc_engine.comparison.evaluation import DEFAULT_MODELS, evaluate_models, model_curve, model_lines
from etc_engine.comparison.fits import Fit, Parameter, fit_models
from etc_engine.comparison.simulation import Phases, mean_diagonal, phases, simulated

__all__ = [
    "DEFAULT_MODELS",
    "Fit",
    "Parameter",
    "Phases",
    "evaluate_models",
    "fit_models",
    "mean_diagonal",
    "model_curve",
    "model_lines",
    "phases",
    "running_statistics",
    "samples",
    "simulated",
    "system_sizes",
]
