"""Names of the biped that the command line knows, and of what its runs leave."""

BIPED_BASELINES = (
    "constant-torque",
    "crank-speed-pi",
    "computed-torque",
    "optimal-gait",
    "stop-at-mark",
)
STOPPING = "stop-at-mark"
"""The one for tasks with a mark; without one it follows gaits as optimal-gait does."""
FILM, FRAMES = "walk.gif", 25.0
"""The animation of a finished run, and its pictures a second."""
AXES = {
    "mu": "static and kinetic friction of one floor",
    "mu_static, mu_kinetic": "either, of the task's floor",
    "payload": "mass on the hip [kg]",
    "commanded_rate": "mean crank rate [rad/s]",
    "torque_limit": "of the motor [N m]",
    "slip_weight, energy_weight": "of the reward, and its other weights",
    "robot.gravity": "[m/s^2], and any other number of the robot: robot.mass.12 is the hip's [kg]",
    "randomisation.friction.0": "an end of a range that a reset draws from",
}
"""For the help of a sweep."""
