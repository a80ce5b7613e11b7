"""Fast evaluation of CasADi functions on arrays of samples."""

from robots.batch.base import BatchFunction, batch_function
from robots.batch.building import builds_expressions

__all__ = ["BatchFunction", "batch_function", "builds_expressions"]
