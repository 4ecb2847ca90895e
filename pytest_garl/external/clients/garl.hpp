// The link of a C++ program to pytest-garl: one header, C++17, POSIX, no dependencies.
//
//     #include "garl.hpp"
//     int main() {
//       garl::Link link;                               // or garl::Link link("NED", {"image"});
//       auto [x, y] = link.mission.gps_position_m;
//       while (const garl::Observation* seen = link.next()) {  // one camera frame after the other
//         const std::uint8_t* picture = seen->image;           // RGB, height x width x 3
//         link.position({x, y, 5.0}, 1.5);                     // one command for each frame
//       }
//     }
//
// The loop ends with the flight.  std::cout and printf go to stderr, because stdout is the link.
// docs/protocol.md of pytest-garl describes missions, observations and commands.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <locale>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace garl {

constexpr int kProtocol = 1;
using Vec2 = std::array<double, 2>;
using Vec3 = std::array<double, 3>;
using Quaternion = std::array<double, 4>;  // x, y, z, w: from the body to the world

struct Camera {
  int width_px = 0, height_px = 0;
  double field_of_view_rad = 0, rate_hz = 0, focal_px = 0;
  Vec2 centre_px{};
  std::vector<double> distortion;
  double yaw_rad = 0, tilt_rad = 0;  // how it is mounted: 0 looks straight down, its top ahead
  Vec3 offset_m{};
};

struct Mission {
  Vec2 gps_position_m{};
  Vec3 home_m{};
  double search_altitude_m = 0, marker_side_m = 0, time_limit_s = 0;
  int marker_id = 0;
  std::string marker_dictionary;
  Camera camera;
};

// The readings of one camera frame; the pictures are there until the frame is answered.
struct Observation {
  long frame = 0;
  double time_s = 0;
  Vec3 position_m{}, velocity_mps{};
  Quaternion attitude{};
  const std::uint8_t* image = nullptr;  // RGB, row by row
  const float* depth_m = nullptr;       // planar depth, 0 where nothing is measured
  std::optional<double> rangefinder_m;
};

struct Detection {
  int marker_id = 0;
  double confidence = 0;
  Vec3 position_m{};
  std::vector<Vec2> corners_px;
};

// What the program thinks, for the reports; all of it is optional.
struct Diagnostics {
  std::string phase, note;
  std::vector<Detection> detections;
  std::optional<Vec3> target_m;
};

// More of a position; what is not given is left to pytest-garl.
struct Limits {
  std::optional<double> yaw_rad{}, acceleration_mps2{}, tilt_rad{};
};

namespace json {

struct Value {
  double number = 0;
  bool is_number = false;
  std::string text;
  std::vector<Value> items;
  std::map<std::string, Value> fields;
  const Value& at(const std::string& key) const {
    auto found = fields.find(key);
    if (found == fields.end()) throw std::runtime_error("pytest-garl sent no " + key);
    return found->second;
  }
  template <std::size_t N>
  std::array<double, N> vector() const {
    if (items.size() != N) throw std::runtime_error("pytest-garl sent a vector of another length");
    std::array<double, N> found{};
    for (std::size_t i = 0; i < N; ++i) found[i] = items[i].number;
    return found;
  }
};

class Reader {
 public:
  explicit Reader(const std::string& text) : text_(text) {}
  Value value() {
    Value found;
    switch (peek()) {
      case '{':
        list('}', [&] {
          std::string key = string();
          expect(':');
          found.fields[key] = value();
        });
        break;
      case '[':
        list(']', [&] { found.items.push_back(value()); });
        break;
      case '"':
        found.text = string();
        break;
      default:
        scalar(found);
    }
    return found;
  }

 private:
  char peek() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    if (at_ >= text_.size()) throw std::runtime_error("pytest-garl sent half a line");
    return text_[at_];
  }
  void expect(char wanted) {
    if (peek() != wanted) throw std::runtime_error("pytest-garl sent a line that is no JSON");
    ++at_;
  }
  template <typename Each>
  void list(char end, Each each) {
    ++at_;
    if (peek() == end) {
      ++at_;
      return;
    }
    for (;;) {
      each();
      if (peek() == end) break;
      expect(',');
    }
    ++at_;
  }
  std::string string() {
    expect('"');
    std::string found;
    while (at_ < text_.size() && text_[at_] != '"') {
      if (text_[at_] == '\\') ++at_;  // of escapes only \" and \\ occur in what is read
      if (at_ < text_.size()) found += text_[at_++];
    }
    expect('"');
    return found;
  }
  void scalar(Value& found) {
    std::size_t end = text_.find_first_of(",]} \n", at_);
    found.text = text_.substr(at_, end - at_);
    at_ = end == std::string::npos ? text_.size() : end;
    std::istringstream stream(found.text);
    stream.imbue(std::locale::classic());
    found.is_number = static_cast<bool>(stream >> found.number);
  }
  const std::string& text_;
  std::size_t at_ = 0;
};

// Writes one object, field by field.
class Writer {
 public:
  Writer() {
    out_.imbue(std::locale::classic());
    out_.precision(17);
    out_ << '{';
  }
  Writer& key(const std::string& name) {
    separate();
    quote(name);
    out_ << ':';
    fresh_ = true;
    return *this;
  }
  Writer& open(char bracket) {
    separate();
    out_ << bracket;
    fresh_ = true;
    return *this;
  }
  Writer& close(char bracket) {
    out_ << bracket;
    fresh_ = false;
    return *this;
  }
  Writer& operator<<(double number) {
    separate();
    // Not JSON, but what pytest-garl reads, and names in its report.
    if (std::isnan(number)) out_ << "NaN";
    else if (std::isinf(number)) out_ << (number > 0 ? "Infinity" : "-Infinity");
    else out_ << number;
    return *this;
  }
  Writer& operator<<(const std::string& text) {
    separate();
    quote(text);
    return *this;
  }
  template <std::size_t N>
  Writer& operator<<(const std::array<double, N>& numbers) {
    open('[');
    for (double each : numbers) *this << each;
    return close(']');
  }
  std::string line() {
    out_ << "}\n";
    return out_.str();
  }

 private:
  void separate() {
    if (!fresh_) out_ << ',';
    fresh_ = false;
  }
  void quote(const std::string& text) {
    static const char* digits = "0123456789abcdef";
    out_ << '"';
    for (unsigned char c : text) {
      if (c == '"' || c == '\\') out_ << '\\' << c;
      else if (c < 0x20) out_ << "\\u00" << digits[c >> 4] << digits[c & 15];
      else out_ << c;
    }
    out_ << '"';
  }
  std::ostringstream out_;
  bool fresh_ = true;
};

}  // namespace json

// The link of one flight.  `frame` is "ENU" (and FLU) or "NED" (and FRD), for all that goes in and
// out; `reads` names the data that the program uses: "image", "depth_m", "rangefinder_m".
class Link {
 public:
  Mission mission;

  explicit Link(const std::string& frame = "ENU",
                const std::vector<std::string>& reads = {"image"}) {
    answers_ = ::dup(1);
    ::dup2(2, 1);
    json::Value message;
    if (!read("hello", message)) ::_exit(0);
    json::Writer hello;
    hello.key("type") << std::string("hello");
    hello.key("protocol") << static_cast<double>(kProtocol);
    hello.key("frame") << frame;
    hello.key("reads").open('[');
    for (const std::string& each : reads) hello << each;
    write(hello.close(']').line());
    if (!read("reset", message)) ::_exit(0);
    read_mission(message);
    map_memory(message.at("memory"));
  }
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  // The next camera frame; null at the end of the flight.
  const Observation* next() {
    if (waits_) {
      throw std::logic_error("a frame got no command; expected one command for each frame");
    }
    if (!ready_) {
      write("{\"type\":\"ready\"}\n");
      ready_ = true;
    }
    json::Value message;
    if (!read("step", message)) return nullptr;
    seen_.frame = static_cast<long>(message.at("frame").number);
    seen_.time_s = message.at("time_s").number;
    seen_.position_m = message.at("position_m").vector<3>();
    seen_.velocity_mps = message.at("velocity_mps").vector<3>();
    seen_.attitude = message.at("attitude").vector<4>();
    seen_.rangefinder_m.reset();
    auto range = message.fields.find("rangefinder_m");
    if (range != message.fields.end() && range->second.is_number) {
      seen_.rangefinder_m = range->second.number;
    }
    waits_ = true;
    return &seen_;
  }

  void position(const Vec3& place_m, std::optional<double> speed_mps = {},
                const Diagnostics& said = {}, const Limits& limits = {}) {
    json::Writer answer = begin("position");
    answer.key("position_m") << place_m;
    optional(answer, "speed_mps", speed_mps);
    optional(answer, "yaw_rad", limits.yaw_rad);
    optional(answer, "acceleration_mps2", limits.acceleration_mps2);
    optional(answer, "tilt_rad", limits.tilt_rad);
    end(answer, said);
  }
  void velocity(const Vec3& velocity_mps, std::optional<double> yaw_rad = {},
                const Diagnostics& said = {}) {
    json::Writer answer = begin("velocity");
    answer.key("velocity_mps") << velocity_mps;
    optional(answer, "yaw_rad", yaw_rad);
    end(answer, said);
  }
  void attitude(const Quaternion& attitude, double thrust, const Diagnostics& said = {}) {
    json::Writer answer = begin("attitude");
    answer.key("attitude") << attitude;
    answer.key("thrust") << thrust;
    end(answer, said);
  }
  void land(double speed_mps = 0.5, const Diagnostics& said = {}) {
    json::Writer answer = begin("land");
    answer.key("speed_mps") << speed_mps;
    end(answer, said);
  }
  // Give up: the vehicle climbs away.  It is the last command of a flight.
  void abort(const Diagnostics& said = {}) {
    json::Writer answer = begin("abort");
    end(answer, said);
  }

 private:
  json::Writer begin(const std::string& type) {
    if (!waits_)
      throw std::logic_error(
          "a command without a frame: before the first one, or a second one for it; expected one "
          "command for each frame");
    waits_ = false;
    json::Writer answer;
    answer.key("type") << type;
    answer.key("frame") << static_cast<double>(seen_.frame);
    return answer;
  }
  static void optional(json::Writer& to, const char* name, const std::optional<double>& value) {
    if (value) to.key(name) << *value;
  }
  void end(json::Writer& answer, const Diagnostics& said) {
    answer.key("diagnostics").open('{');
    answer.key("phase") << said.phase;
    answer.key("note") << said.note;
    if (said.target_m) answer.key("target_m") << *said.target_m;
    answer.key("detections").open('[');
    for (const Detection& each : said.detections) {
      answer.open('{');
      answer.key("marker_id") << static_cast<double>(each.marker_id);
      answer.key("confidence") << each.confidence;
      answer.key("position_m") << each.position_m;
      answer.key("corners_px").open('[');
      for (const Vec2& corner : each.corners_px) answer << corner;
      answer.close(']').close('}');
    }
    write(answer.close(']').close('}').line());
  }
  void read_mission(const json::Value& message) {
    const json::Value& camera = message.at("camera");
    mission.gps_position_m = message.at("gps_position_m").vector<2>();
    mission.home_m = message.at("home_m").vector<3>();
    mission.search_altitude_m = message.at("search_altitude_m").number;
    mission.time_limit_s = message.at("time_limit_s").number;
    mission.marker_id = static_cast<int>(message.at("marker_id").number);
    mission.marker_side_m = message.at("marker_side_m").number;
    mission.marker_dictionary = message.at("marker_dictionary").text;
    mission.camera.width_px = static_cast<int>(camera.at("width_px").number);
    mission.camera.height_px = static_cast<int>(camera.at("height_px").number);
    mission.camera.field_of_view_rad = camera.at("field_of_view_rad").number;
    mission.camera.rate_hz = camera.at("rate_hz").number;
    mission.camera.focal_px = camera.at("focal_px").number;
    mission.camera.centre_px = camera.at("centre_px").vector<2>();
    mission.camera.yaw_rad = camera.at("yaw_rad").number;
    mission.camera.tilt_rad = camera.at("tilt_rad").number;
    mission.camera.offset_m = camera.at("offset_m").vector<3>();
    for (const json::Value& each : camera.at("distortion").items) {
      mission.camera.distortion.push_back(each.number);
    }
  }
  void map_memory(const json::Value& memory) {
    const std::string path = memory.at("path").text;
    int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0) throw std::runtime_error("cannot open " + path);
    void* shared = ::mmap(nullptr, static_cast<std::size_t>(memory.at("bytes").number), PROT_READ,
                          MAP_SHARED, file, 0);
    ::close(file);
    if (shared == MAP_FAILED) throw std::runtime_error("cannot map " + path);
    const char* base = static_cast<const char*>(shared);
    auto place = [&](const char* name) -> const void* {
      auto found = memory.fields.find(name);
      if (found == memory.fields.end()) return nullptr;
      return base + static_cast<std::size_t>(found->second.at("offset").number);
    };
    seen_.image = static_cast<const std::uint8_t*>(place("image"));
    seen_.depth_m = static_cast<const float*>(place("depth_m"));
  }
  bool read(const std::string& type, json::Value& message) {
    std::string line;
    for (;;) {
      std::size_t end = buffer_.find('\n');
      if (end != std::string::npos) {
        line = buffer_.substr(0, end);
        buffer_.erase(0, end + 1);
        break;
      }
      char chunk[4096];
      ssize_t count = ::read(0, chunk, sizeof chunk);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return false;
      buffer_.append(chunk, static_cast<std::size_t>(count));
    }
    message = json::Reader(line).value();
    if (message.at("type").text != type) {
      throw std::runtime_error("pytest-garl sent " + message.at("type").text + "; expected " +
                               type);
    }
    return true;
  }
  void write(const std::string& line) {
    std::size_t done = 0;
    while (done < line.size()) {
      ssize_t count = ::write(answers_, line.data() + done, line.size() - done);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) ::_exit(0);  // pytest-garl has ended
      done += static_cast<std::size_t>(count);
    }
  }
  int answers_ = -1;
  bool ready_ = false, waits_ = false;
  std::string buffer_;
  Observation seen_;
};

}  // namespace garl
