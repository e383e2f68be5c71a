"""Training runs of the network, and the evaluation of its results."""
