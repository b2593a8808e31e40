"""Metres about a place on Earth, some hundred of them around it."""
import math

A_M, E2 = 6378137.0, 6.69437999014e-3  # WGS 84.


def metres_a_degree(latitude_deg):
    """East and north."""
    sine = math.sin(math.radians(latitude_deg))
    down = 1 - E2 * sine**2
    return (math.radians(A_M / math.sqrt(down) * math.cos(math.radians(latitude_deg))), math.radians(A_M * (1 - E2) / down**1.5))


def local(origin, point):
    """East, north, up; latitude, longitude, degrees, and altitude, metres."""
    east, north = metres_a_degree(origin[0])
    return (point[1] - origin[1]) * east, (point[0] - origin[0]) * north, point[2] - origin[2]


def geographic(origin, position):
    """Its inverse."""
    east, north = metres_a_degree(origin[0])
    return origin[0] + position[1] / north, origin[1] + position[0] / east, origin[2] + position[2]
