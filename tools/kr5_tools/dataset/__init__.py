"""Folders of images and robot poses: `kr5 dataset`."""
