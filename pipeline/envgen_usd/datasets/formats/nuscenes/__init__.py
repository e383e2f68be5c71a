"""The layout of nuScenes."""
