"""Bicycles and motorcycles, alone and with riders."""
