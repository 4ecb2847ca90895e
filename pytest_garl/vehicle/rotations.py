"""Quaternions (x, y, z, w) as plain floats; a quaternion turns body vectors into world vectors."""

from __future__ import annotations

import math

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


def rotation_between(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation from a to b as seen in a's body frame: inverse of a, times b."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx - ax * bw - ay * bz + az * by,
        aw * by + ax * bz - ay * bw - az * bx,
        aw * bz - ax * by + ay * bx - az * bw,
        aw * bw + ax * bx + ay * by + az * bz,
    )


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Return q applied to v."""
    x, y, z, w = q
    vx, vy, vz = v
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def integrate_rates(q: Quaternion, rates: Vector, dt_s: float) -> Quaternion:
    """Return q after turning with body rates for a short time, normalised."""
    half = 0.5 * dt_s
    qx, qy, qz, qw = q
    rx, ry, rz = rates[0] * half, rates[1] * half, rates[2] * half
    x = qx + qw * rx + qy * rz - qz * ry
    y = qy + qw * ry - qx * rz + qz * rx
    z = qz + qw * rz + qx * ry - qy * rx
    w = qw - qx * rx - qy * ry - qz * rz
    size = math.sqrt(x * x + y * y + z * z + w * w)
    return x / size, y / size, z / size, w / size


def yaw_of(q: Quaternion) -> float:
    """Return the heading of the body's x axis in radians, counter-clockwise from east."""
    x, y, z, w = q
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def heading_quaternion(thrust: Vector, yaw_rad: float) -> Quaternion:
    """Return the attitude whose z axis is along ``thrust``, turned by ``yaw_rad`` about it."""
    tx, ty, tz = thrust
    size = math.sqrt(tx * tx + ty * ty + tz * tz)
    # The shortest turn from the vertical to a direction n is (-ny, nx, 0, 1 + nz), normalised.
    nx, ny, w = tx / size, ty / size, 1 + tz / size
    norm = math.sqrt(nx * nx + ny * ny + w * w)
    s, c = math.sin(yaw_rad / 2), math.cos(yaw_rad / 2)
    x, y, w = -ny / norm, nx / norm, w / norm
    return x * c + y * s, y * c - x * s, w * s, w * c


def tilt_and_turn(q: Quaternion) -> tuple[float, float, float]:
    """Split a rotation into a turn about z followed by a tilt; return tilt x, tilt y and turn.

    The tilt is a rotation vector in the frame in which q starts; it aligns the z axes.  The turn
    is the remaining change of heading, in (-pi, pi].
    """
    x, y, z, w = q
    if w < 0:
        x, y, z, w = -x, -y, -z, -w
    n = math.sqrt(z * z + w * w)
    if n < 1e-9:
        return math.pi, 0.0, 0.0  # upside down: a tilt about any horizontal axis is as short
    ux, uy = (x * w - y * z) / n, (x * z + y * w) / n
    s = math.sqrt(ux * ux + uy * uy)
    factor = 2 * math.atan2(s, n) / s if s > 1e-9 else 2.0
    return ux * factor, uy * factor, 2 * math.atan2(z, w)
