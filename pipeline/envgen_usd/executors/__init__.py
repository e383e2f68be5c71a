"""Who runs the tasks of a build: processes of this machine, a Ray cluster, or Slurm."""
