"""The asset library: catalogue, distributions and authoring."""
