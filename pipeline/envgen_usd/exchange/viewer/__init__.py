"""A page that shows an export in a browser, and the server of this machine that serves it."""
