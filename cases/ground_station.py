"""Makes ground_station.csv: gimbal angles that keep an antenna on a ground station while a satellite passes over.

Orbit of 500 km altitude, inclination 51.6 deg, from its node; the satellite keeps its axes up, forward and along the
orbit normal. The station is 2 deg of arc beside the track, abeam after 200 s, and turns with the Earth. The gimbal
turns about its z axis ("along"), then about its y axis ("across"), x of the antenna looks at the station; the boom that
carries it points down and is straight. Run it to write the table anew; it prints what gimbal_antenna.toml expects.
"""

from pathlib import Path

import numpy as np

MU, EARTH_RATE, RADIUS = 3.986004418e14, 7.292115e-5, 6378137.0  # m^3/s^2, rad/s, m
ORBIT, INCLINATION = RADIUS + 500e3, np.deg2rad(51.6)
ABEAM, BESIDE = 200.0, np.deg2rad(2.0)  # s, arc from the track
BOOM, MOUNT, DISH = 33.0, 1.2, 0.3  # m: boom, its root below the hub's centre, antenna's centre of mass from the gimbal
HUB_MASS, ANTENNA_MASS = 1500.0, 40.0  # kg
TUBE_MASS = 1600.0 * np.pi * (0.080**2 - 0.079**2) * BOOM  # kg
DEFLECTION = np.array([1.0, 0.7])  # m, of the boom's tip at the start along its y and z
SLOPE = 1.376505 / BOOM  # of the first clamped-free mode at its tip, per unit of deflection there
RATE = np.sqrt(MU / ORBIT**3)


def axes(t):
    """Rows normal, up, forward of the orbital frame at t, inertial components (Z the pole, X the node)."""
    u = RATE * t
    c, s = np.cos(INCLINATION), np.sin(INCLINATION)
    up = np.array([np.cos(u), np.sin(u) * c, np.sin(u) * s])
    forward = np.array([-np.sin(u), np.cos(u) * c, np.cos(u) * s])
    return np.array([np.cross(up, forward), up, forward])


def station(t):
    """Latitude, longitude from X at t = 0, and place at t of the station."""
    normal, up, _ = axes(ABEAM)
    place = np.cos(BESIDE) * up + np.sin(BESIDE) * normal
    latitude, meridian = np.arcsin(place[2]), np.arctan2(place[1], place[0]) - EARTH_RATE * ABEAM
    now = meridian + EARTH_RATE * t
    level = np.cos(latitude) * np.array([np.cos(now), np.sin(now)])
    return latitude, meridian, RADIUS * np.array([*level, np.sin(latitude)])


def sight(t):
    """Vector from the gimbal to the station in axes down, forward, against the normal: those of the boom's tip."""
    normal, up, forward = axes(t)
    below = MOUNT + BOOM  # of the gimbal from the hub's centre; the centre of mass of all is on the orbit
    total = HUB_MASS + TUBE_MASS + ANTENNA_MASS
    center = (TUBE_MASS * (MOUNT + BOOM / 2) + ANTENNA_MASS * below) / total
    away = station(t)[2] - (ORBIT - (below - center)) * up
    return np.array([-up, forward, -normal]) @ away


def angles(t):
    """along and across [rad]: x of the antenna is Rz(along) Ry(across) x."""
    x, y, z = sight(t)
    return np.arctan2(y, x), -np.arctan2(z, np.hypot(x, y))


def first_error():
    """Angle by which the bent boom turns the antenna off the station at the start [rad]."""
    forward, across = DEFLECTION * SLOPE
    turn = np.array([0.0, -across, forward])  # about the tip's z for a deflection along y, about -y for one along z
    ahead = sight(0.0) / np.linalg.norm(sight(0.0))
    size, once = np.linalg.norm(turn), np.cross(turn, ahead)
    turned = ahead + np.sin(size) / size * once + (1 - np.cos(size)) / size**2 * np.cross(turn, once)
    return np.arctan2(np.linalg.norm(np.cross(turned, ahead)), turned @ ahead)


if __name__ == "__main__":
    rows = ["time [s],along [deg],across [deg]"]
    for t in np.arange(-20.0, 421.0, 10.0):
        rows.append("{:g},{:.9f},{:.9f}".format(t, *np.rad2deg(angles(t))))
    Path(__file__).with_name("ground_station.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    latitude, longitude, _ = station(0.0)
    print(f"latitude {np.rad2deg(latitude):.9f} deg, longitude {np.rad2deg(longitude):.9f} deg")
    span = np.linspace(0.0, 400.0, 40001)
    nearest = min(np.linalg.norm(sight(t)) for t in span)
    print(f"nearest {nearest:.3f} m, abeam along {np.rad2deg(angles(ABEAM)[0]):.6f} deg, ", end="")
    print(f"across {np.rad2deg(angles(ABEAM)[1]):.6f} deg, off at the start {np.rad2deg(first_error()):.5f} deg")
