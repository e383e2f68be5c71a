"""Training data: drawn road layouts, ground truth, masks and batches."""
