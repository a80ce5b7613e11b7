"""Fast evaluation of CasADi functions on arrays of samples."""

from robots.batch.base import BatchFunction, batch_function

__all__ = ["BatchFunction", "batch_function"]
