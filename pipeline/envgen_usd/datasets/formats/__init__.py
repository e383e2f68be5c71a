"""Layouts of other data sets, and recordings for the Rerun viewer."""
