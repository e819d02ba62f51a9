"""KUKA's RobotSensorInterface at the terminal: `kr5 rsi`."""
