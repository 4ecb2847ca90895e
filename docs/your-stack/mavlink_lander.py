"""Lands on an ArUco marker: a companion program over MAVLink, as it flies the real vehicle."""

import argparse
import math
import time

import cv2
from pymavlink import mavutil

KEEP_YAW = 0b110111111000  # a position alone counts


def main() -> None:
    """Take off, fly to the coordinate, and come down over the marker."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--connect", default="udp:0.0.0.0:14550")
    parser.add_argument("--camera", default="0")
    parser.add_argument("--dictionary", default="DICT_5X5_50")
    parser.add_argument("--marker", type=int, default=0)
    parser.add_argument("--north", type=float, default=0.0)
    parser.add_argument("--east", type=float, default=0.0)
    parser.add_argument("--altitude", type=float, default=10.0)
    parser.add_argument("--focal", type=float, required=True)
    options = parser.parse_args()
    link = mavutil.mavlink_connection(options.connect)
    link.wait_heartbeat()
    take_off(link, options.altitude)
    goto(link, options.north, options.east, -options.altitude)
    camera = cv2.VideoCapture(options.camera)
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, options.dictionary))
    detector = cv2.aruco.ArucoDetector(dictionary)
    seen_s = time.monotonic()
    while True:
        _, image = camera.read()
        while link.recv_match(type=["LOCAL_POSITION_NED", "ATTITUDE"]):
            continue
        here, attitude = link.messages["LOCAL_POSITION_NED"], link.messages["ATTITUDE"]
        corners, ids, _ = detector.detectMarkers(image)
        numbers = [] if ids is None else [int(each) for each in ids.ravel()]
        if options.marker not in numbers:
            if time.monotonic() - seen_s > 3.0:
                goto(link, options.north, options.east, -options.altitude)
            continue
        seen_s = time.monotonic()
        u, v = corners[numbers.index(options.marker)].reshape(4, 2).mean(axis=0)
        right = (u - (image.shape[1] - 1) / 2) / options.focal
        forward = ((image.shape[0] - 1) / 2 - v) / options.focal
        north, east, down = in_ned(attitude, forward, right, 1.0)
        north, east = north / down * -here.z, east / down * -here.z
        off = math.hypot(north, east)
        if -here.z < 2.0 and off < 0.2:
            print(f"lands {off:.2f} m off")
            link.set_mode("LAND")
            return
        lower = here.z + 1.0 if off < 0.3 - 0.1 * here.z else here.z
        goto(link, here.x + north, here.y + east, min(lower, -0.5))


def take_off(link: mavutil.mavfile, altitude: float) -> None:
    """Arm, and climb to an altitude."""
    link.set_mode("GUIDED")
    link.arducopter_arm()
    link.motors_armed_wait()
    command = mavutil.mavlink.MAV_CMD_NAV_TAKEOFF
    link.mav.command_long_send(1, 1, command, 0, 0, 0, 0, 0, 0, 0, altitude)
    while True:
        here = link.recv_match(type="LOCAL_POSITION_NED", blocking=True)
        if -here.z > altitude - 0.5:
            return


def goto(link: mavutil.mavfile, north: float, east: float, down: float) -> None:
    """Fly to a place in the local frame."""
    frame = mavutil.mavlink.MAV_FRAME_LOCAL_NED
    place = (north, east, down)
    link.mav.set_position_target_local_ned_send(0, 1, 1, frame, KEEP_YAW, *place, *[0] * 8)


def in_ned(attitude: object, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Turn a vector of the body (forward, right, down) to north, east, down."""
    cr, sr = math.cos(attitude.roll), math.sin(attitude.roll)
    cp, sp = math.cos(attitude.pitch), math.sin(attitude.pitch)
    cy, sy = math.cos(attitude.yaw), math.sin(attitude.yaw)
    y, z = cr * y - sr * z, sr * y + cr * z
    x, z = cp * x + sp * z, -sp * x + cp * z
    return cy * x - sy * y, sy * x + cy * y, z


main()
