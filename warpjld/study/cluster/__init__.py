"""Studies on a Ray cluster: machines receive trials and input files, and return results, which the driver writes."""

from warpjld.study.cluster.run import run_on_ray

__all__ = ["run_on_ray"]
