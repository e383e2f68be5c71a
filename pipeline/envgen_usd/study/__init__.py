"""The study: how many real images synthetic ones replace, and what keeps them from it."""
