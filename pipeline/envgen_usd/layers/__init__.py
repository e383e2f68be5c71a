"""The USD sublayers and the stage that composes them; each sublayer has a module."""
