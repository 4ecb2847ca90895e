// A landing system in C++ without a library: it flies to the coordinate, takes the middle of what is
// white in the picture for the marker, and descends on it.
#include <algorithm>
#include <cmath>
#include <iostream>

#include "garl.hpp"

// Return the place on the ground that a pixel shows, as (x, y) from the vehicle.
static garl::Vec2 on_ground(const garl::Camera& camera, const garl::Observation& seen, double u,
                            double v) {
  auto [x, y, z, w] = seen.attitude;
  // Image down is the body's back, image right the body's right; the camera looks down.
  double a = (camera.centre_px[1] - v) / camera.focal_px;
  double b = (camera.centre_px[0] - u) / camera.focal_px;
  double c = -1;
  double east = (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - w * z) * b + 2 * (x * z + w * y) * c;
  double north = 2 * (x * y + w * z) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z - w * x) * c;
  double up = 2 * (x * z - w * y) * a + 2 * (y * z + w * x) * b + (1 - 2 * (x * x + y * y)) * c;
  double range = up < -0.1 ? -seen.position_m[2] / up : 0;
  return {east * range, north * range};
}

int main() {
  garl::Link link;
  const garl::Camera& camera = link.mission.camera;
  auto [goal_x, goal_y] = link.mission.gps_position_m;
  bool lands = false;
  while (const garl::Observation* seen = link.next()) {
    double columns = 0, rows = 0;
    long count = 0;
    for (int row = 0; row < camera.height_px; ++row) {
      for (int column = 0; column < camera.width_px; ++column) {
        const std::uint8_t* rgb = seen->image + 3 * (row * camera.width_px + column);
        if (std::min({rgb[0], rgb[1], rgb[2]}) > 200) columns += column, rows += row, ++count;
      }
    }
    auto [x, y, z] = seen->position_m;
    garl::Diagnostics said;
    said.phase = count > 10 ? "approach" : "search";
    if (count > 10) {
      garl::Vec2 away = on_ground(camera, *seen, columns / count, rows / count);
      goal_x = x + away[0], goal_y = y + away[1];
      said.target_m = garl::Vec3{goal_x, goal_y, 0};
    }
    double beside = std::hypot(goal_x - x, goal_y - y);
    lands = lands || (count > 10 && z < 1.0 && beside < 0.3);
    if (lands) {
      link.land(0.5, said);
    } else {
      bool above = count > 10 && beside < 0.5;
      double height = above ? std::max(z - 1.0, 0.5) : count > 10 ? z : link.mission.search_altitude_m;
      link.position({goal_x, goal_y, height}, 1.5, said);
    }
  }
  std::cout << "the flight has ended\n";  // goes to stderr
}
