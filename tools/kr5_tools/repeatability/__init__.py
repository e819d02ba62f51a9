"""Pose repeatability and accuracy after ISO 9283."""
