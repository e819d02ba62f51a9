"""A force loop from a step and ten readings of a contact: servo, stiffness, gain."""

import numpy as np
from kr5 import force, identification

# A step of 24 mm, read every 12 ms; its response as a critically damped servo of 4 rad/s, 30 ms late, would show it.
t = np.linspace(0.0, 399 * 0.012, 400)
command = np.full(400, 0.024)
command[0] = 0.0
since = 4.0 * np.maximum(t - 0.042, 0.0)
response = 0.024 * (1 - (1 + since) * np.exp(-since)) + 1e-5 * np.sin(50 * t)
servo = identification.identify_servo(identification.ServoLog(t=t, command=command, response=response))
print(
    f"servo: {servo.servo.natural_frequency:.2f} rad/s, damping {servo.servo.damping_ratio:.3f},"
    f" delay {1e3 * servo.servo.delay:.1f} ms"
)

depth = np.linspace(-0.2e-3, 0.7e-3, 10)
pressed = 23.38e3 * np.maximum(depth, 0.0) + 0.1 * (2 * (np.arange(10) % 2) - 1)
contact = identification.identify_contact_stiffness(identification.ContactLog(depth=depth, force=pressed))
print(f"contact: {1e-3 * contact.stiffness:.2f} N/mm, from {contact.contact_readings} readings")

plant = identification.ForceLoopPlant(servo=servo.servo, servo_gain=servo.gain, stiffness=contact.stiffness)
design = identification.design_force_loop(plant, force.ForceLoopOptions(stiffness=contact.stiffness))
print(
    f"gain below {1e3 * design.nominal.gain_limit:.3f} mm/N; at 0.005 mm/N: compensator {design.compensator:.2f},"
    f" overshoot {100 * design.nominal.overshoot:.1f} %"
)
