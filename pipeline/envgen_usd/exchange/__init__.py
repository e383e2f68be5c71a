"""From a composed stage to what other programs read: glTF, metadata, and pages that show it."""
