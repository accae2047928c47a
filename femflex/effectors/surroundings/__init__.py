"""Surroundings of a craft as functions of time and place: sun, moon, air and magnetic field.

Each is a noun with channels, which effectors, controllers and sensors take as inputs, and a run reports.

INERTIAL AXES are those of the mean equator and equinox of the epoch: X towards the equinox, Z the Earth's axis. The
Earth turns about Z at a constant rate from the mean sidereal time of the epoch. UTC is taken for UT1 and for
terrestrial time, which moves the sun by 0.001 deg, the moon by 0.01 deg and the Earth by less than 0.004 deg.
"""
