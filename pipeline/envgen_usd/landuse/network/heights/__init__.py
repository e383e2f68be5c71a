"""Networks that fill height maps: data, task and evaluation."""
