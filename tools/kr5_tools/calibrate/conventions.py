"""Forms of poses in tables, by the name of their convention."""

CONVENTIONS = {  # name: columns after x y z, form, unit of angles
    "quaternion": (("qx", "qy", "qz", "qw"), "quaternion_xyzw", "rad"),
    "rotation_vector": (("rx", "ry", "rz"), "rotation_vector", "rad"),
    "rpy": (("roll", "pitch", "yaw"), "rpy", "rad"),
    "kuka": (("a", "b", "c"), "kuka_abc", "deg"),
}
