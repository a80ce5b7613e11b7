// Plays a trajectory on a Franka arm at 1 kHz and logs what the arm does.
//
// Build:  g++ -std=c++17 -O2 player.cpp -o player -lfranka -pthread
// Use:    ./player HOST trajectory.csv log.csv [--dry-run]
//
// trajectory.csv is what `oed export --to franka` writes. The log has t [s], q, dq [rad, rad/s] and tau [N m] of the
// link-side sensors, and is read by `oed identify` as it is. Exit codes: 0 done, 1 not possible, 2 wrong input.

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <franka/control_types.h>
#include <franka/duration.h>
#include <franka/exception.h>
#include <franka/lowpass_filter.h>
#include <franka/robot.h>
#include <franka/robot_state.h>

namespace {

using Joints = std::array<double, 7>;

// Farthest start pose from the first point, and farthest position from the plan [rad].
constexpr double kStartTolerance = @START_TOLERANCE@;
constexpr double kTolerance = 0.1;
// Time in which the arm is brought from its pose to the first point [s], and between two points.
constexpr double kApproach = 2.0;
constexpr double kPeriod = 0.001;

std::atomic<bool> interrupted{false};

struct Sample {
  double t;
  Joints q, dq, tau;
};

struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::vector<Joints> readTrajectory(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  if (!file || !std::getline(file, line)) {
    throw InputError(path + " cannot be read");
  }
  std::vector<Joints> points;
  for (std::size_t row = 0; std::getline(file, line); ++row) {
    std::istringstream cells(line);
    std::string cell;
    std::array<double, 8> values{};
    for (double& value : values) {
      try {
        if (!std::getline(cells, cell, ',')) throw std::invalid_argument(cell);
        value = std::stod(cell);
      } catch (const std::exception&) {
        throw InputError(path + ": row " + std::to_string(row + 2) + " has no time and seven positions");
      }
    }
    if (std::abs(values[0] - kPeriod * static_cast<double>(row)) > 1e-6) {
      throw InputError(path + ": row " + std::to_string(row + 2) + " is not at a multiple of 1 ms");
    }
    Joints q{};
    std::copy(values.begin() + 1, values.end(), q.begin());
    points.push_back(q);
  }
  if (points.size() < 2) {
    throw InputError(path + " has no points");
  }
  return points;
}

void requireNear(const Joints& q, const Joints& planned, double tolerance, const std::string& what) {
  for (std::size_t joint = 0; joint < 7; ++joint) {
    if (!(std::abs(q[joint] - planned[joint]) <= tolerance)) {
      std::ostringstream text;
      text << "joint " << joint + 1 << ": " << what << " at " << q[joint] << " rad, the plan is " << planned[joint]
           << " rad";
      throw InputError(text.str());
    }
  }
}

void writeLog(const std::string& path, const std::vector<Sample>& samples) {
  std::ofstream file(path);
  file.precision(12);
  file << "t";
  for (const char* name : {"q", "dq", "tau"}) {
    for (int joint = 1; joint <= 7; ++joint) file << ',' << name << joint;
  }
  file << '\n';
  for (const Sample& sample : samples) {
    file << sample.t;
    for (const Joints* values : {&sample.q, &sample.dq, &sample.tau}) {
      for (double value : *values) file << ',' << value;
    }
    file << '\n';
  }
  file.flush();
  if (!file) {
    throw InputError(path + " cannot be written");
  }
}

// From rest to rest within one second of unit time: velocity, acceleration and jerk begin and end at zero.
double smooth(double s) {
  return s * s * s * s * (35.0 + s * (-84.0 + s * (70.0 - 20.0 * s)));
}

}  // namespace

int main(int argc, char** argv) {
  const bool dry = argc == 5 && std::string(argv[4]) == "--dry-run";
  if (argc != 4 && !dry) {
    std::cerr << "usage: " << argv[0] << " HOST trajectory.csv log.csv [--dry-run]\n";
    return 2;
  }
  std::vector<Sample> samples;
  int code = 0;
  try {
    const std::vector<Joints> points = readTrajectory(argv[2]);
    if (!dry && std::ifstream(argv[3])) {
      throw InputError(std::string(argv[3]) + " exists");
    }
    samples.reserve(points.size() + 10000);
    franka::Robot robot(argv[1]);
    const franka::RobotState first = robot.readOnce();
    requireNear(first.q, points.front(), kStartTolerance, "the arm is");
    requireNear(first.q_d, points.front(), kStartTolerance, "the arm is commanded");
    if (dry) {
      std::cout << points.size() << " points may be played; nothing was sent\n";
      return 0;
    }
    std::signal(SIGINT, [](int) { interrupted = true; });
    double time = 0.0;
    const Joints begin = first.q_d;
    robot.control(
        [&](const franka::RobotState& state, franka::Duration period) -> franka::JointPositions {
          time += period.toSec();
          samples.push_back({time, state.q, state.dq, state.tau_J});
          if (interrupted) throw std::runtime_error("interrupted");
          if (time < kApproach) {
            const double share = smooth(time / kApproach);
            Joints q{};
            for (std::size_t joint = 0; joint < 7; ++joint) {
              q[joint] = begin[joint] + share * (points.front()[joint] - begin[joint]);
            }
            return franka::JointPositions(q);
          }
          const auto index = static_cast<std::size_t>(std::lround((time - kApproach) / kPeriod));
          const Joints& planned = points[std::min(index, points.size() - 1)];
          requireNear(state.q, planned, kTolerance, "the arm has left the plan: it is");
          if (index + 1 >= points.size()) {
            return franka::MotionFinished(franka::JointPositions(planned));
          }
          return franka::JointPositions(planned);
        },
        franka::ControllerMode::kJointImpedance, true, franka::kMaxCutoffFrequency);
    std::cout << points.size() << " points played\n";
  } catch (const InputError& error) {
    std::cerr << argv[0] << ": " << error.what() << '\n';
    code = samples.empty() ? 2 : 1;
  } catch (const std::exception& error) {
    std::cerr << argv[0] << ": " << error.what() << '\n';
    code = 1;
  }
  if (!samples.empty()) {
    try {
      writeLog(argv[3], samples);
      std::cout << samples.size() << " rows in " << argv[3] << '\n';
    } catch (const InputError& error) {
      std::cerr << argv[0] << ": " << error.what() << '\n';
      return 2;
    }
  }
  return code;
}
