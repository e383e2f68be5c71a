"""The tasks of the network: class maps and height maps."""
