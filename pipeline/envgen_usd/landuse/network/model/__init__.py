"""The mask-aware transformer: generator, critic, and their parts."""
