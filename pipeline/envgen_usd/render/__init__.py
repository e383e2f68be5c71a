"""From a composed stage to camera images and label images."""
