"""One module for each USD sublayer, and the stage that composes them."""
