"""The layout of KITTI-360."""
