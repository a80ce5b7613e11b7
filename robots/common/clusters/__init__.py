"""Workers of a Dask cluster as an executor of ``concurrent.futures``."""

from robots.common.clusters.connection import ClusterWarning, cluster
from robots.common.clusters.executor import ClusterExecutor
from robots.common.clusters.tasks import Link

__all__ = ["ClusterExecutor", "ClusterWarning", "Link", "cluster"]
