// Stub of libfranka's header: the signatures that the player uses, and an arm that follows its commands.
//
// The environment says where it stands (POSE, all joints), which command it does not follow any more (STALL, in ms),
// and which packets are lost (LOSE: every so many).
#pragma once
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <franka/control_types.h>
#include <franka/duration.h>
#include <franka/exception.h>
#include <franka/lowpass_filter.h>
#include <franka/robot_state.h>
namespace franka {
class Robot {
 public:
  explicit Robot(const std::string& franka_address,
                 RealtimeConfig realtime_config = RealtimeConfig::kEnforce,
                 size_t log_size = 50) {
    (void)realtime_config;
    (void)log_size;
    if (franka_address == "nowhere") throw NetworkException("libfranka: Connection to FCI refused.");
    const char* pose = std::getenv("POSE");
    state_.q.fill(pose ? std::atof(pose) : 0.0);
    state_.q_d = state_.q;
  }
  RobotState readOnce() { return state_; }
  void control(
      std::function<JointPositions(const RobotState&, franka::Duration)> motion_generator_callback,
      ControllerMode controller_mode = ControllerMode::kJointImpedance,
      bool limit_rate = true,
      double cutoff_frequency = kDefaultCutoffFrequency) {
    (void)controller_mode;
    (void)limit_rate;
    (void)cutoff_frequency;
    const char* stall = std::getenv("STALL");
    const char* lose = std::getenv("LOSE");
    std::ofstream sent("commands.csv");
    sent.precision(17);
    for (unsigned long k = 0, step = 0;; k += step) {
      const JointPositions command = motion_generator_callback(state_, Duration(step));
      for (double q : command.q) sent << q << ',';
      sent << k << '\n';
      if (!stall || k < std::strtoul(stall, nullptr, 10)) {
        for (int j = 0; j < 7; ++j) {
          state_.dq[j] = (command.q[j] - state_.q[j]) / 0.001;
          state_.q[j] = command.q[j];
          state_.tau_J[j] = j + 1 + command.q[j];
        }
      }
      state_.q_d = command.q;
      if (command.motion_finished) return;
      step = lose && k % std::strtoul(lose, nullptr, 10) == 1 ? 2 : 1;
    }
  }

 private:
  RobotState state_;
};
}  // namespace franka
