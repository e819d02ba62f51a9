"""`kr5 uncertainty`: covariances through chains of poses, of camera, scanner and both fused."""
