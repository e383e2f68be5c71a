"""The table of contents of every product: layers joined into builds and city models."""
