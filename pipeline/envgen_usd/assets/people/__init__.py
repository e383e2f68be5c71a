"""People: a skeleton in poses, and bodies and clothes around it."""
