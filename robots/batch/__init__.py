"""Fast evaluation of CasADi functions on arrays of samples."""

from robots.batch.base import BatchFunction
from robots.batch.building import builds_expressions
from robots.batch.factory import batch_function

__all__ = ["BatchFunction", "batch_function", "builds_expressions"]
