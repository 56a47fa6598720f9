"""Studies on many machines by Ray: trials travel, inputs with them by hash, and results come back to be written."""

from warpjld.study.cluster.run import run_on_ray

__all__ = ["run_on_ray"]
